#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| _ = harness::fuzzing::image(bytes));
