//! Bytes as frames, time and owner's doings for one node, in both dialects.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::canopen_harness::script::run(input);
});
