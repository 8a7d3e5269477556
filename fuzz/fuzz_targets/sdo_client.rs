//! Bytes as transfers of an SDO client: with a model of a server on a bad wire, or with a server
//! that says anything.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    servobus_fuzz::sdo_client_harness::script::run(input);
});
