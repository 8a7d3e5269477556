//! Bytes as an EDS or DCF: read, looked up, written and read again.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::eds_harness::run(input);
});
