#![no_main]

use tessera_tests::decoders::wire;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    wire::join(bytes);
});
