//! Bytes as requests to the SDO servers of a device with everything, time, and an owner's doings.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::canopen_harness::sdo_server::run(input);
});
