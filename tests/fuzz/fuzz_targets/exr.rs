#![no_main]

use tessera_tests::decoders::picture;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    picture::exr(bytes);
});
