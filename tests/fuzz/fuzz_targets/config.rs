#![no_main]

use tessera_tests::decoders::settings;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    settings::config(bytes);
});
