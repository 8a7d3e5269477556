//! Bytes as frames, time, sensors and host's doings for a whole P3.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::drive_harness::script::run(input);
});
