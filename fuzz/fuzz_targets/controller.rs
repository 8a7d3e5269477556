//! Frames, serial bytes, time and sensors for a whole Roboteq controller.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::drive_harness::controller::run(input);
});
