#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| trueline_fuzz::run("dxf", bytes));
