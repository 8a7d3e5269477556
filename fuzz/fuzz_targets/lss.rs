//! Bytes as requests, answers, time and jobs for LSS slaves and a master on a wire that loses frames.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::canopen_harness::lss::run(input);
});
