#![no_main]

use tessera_tests::decoders::image;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    image::any(bytes);
});
