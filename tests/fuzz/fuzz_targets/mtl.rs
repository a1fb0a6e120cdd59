#![no_main]

use tessera_tests::decoders::model;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    model::mtl(bytes);
});
