#![no_main]

use tessera_tests::decoders::identity;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    identity::identity(bytes);
});
