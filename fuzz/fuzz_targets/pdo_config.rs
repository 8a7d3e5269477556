//! Bytes as PDO configurations, frames, time and application's doings for a node with everything.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::canopen_harness::config::run(input);
});
