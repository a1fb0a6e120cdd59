#![no_main]

use tessera_tests::decoders::script;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    script::job(bytes);
});
