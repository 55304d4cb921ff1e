#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| trueline_fuzz::run("profiles_parquet", bytes));
