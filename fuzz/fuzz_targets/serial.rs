//! Bytes over a serial command line, with time, hang-ups and stores between.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::serial_harness::run(input);
});
