#![no_main]

use tessera_tests::decoders::journal;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    journal::events(bytes);
});
