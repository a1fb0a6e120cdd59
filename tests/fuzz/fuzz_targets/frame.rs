#![no_main]

use tessera_tests::decoders::scene;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    scene::frame(bytes);
});
