#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bp_fuzz::run(harness::fuzzing::frames, bytes);
});
