# What one types often. Without `just`: the commands stand as they are.

# All tests.
test:
    cargo test --release --workspace

# Everything that has to hold before a change is taken.
ci:
    .ci/run

# Feeds garbage to all decoders, for so many seconds each.
fuzz seconds="20":
    tests/fuzz/run {{seconds}}

# Puts sources in form.
fmt:
    cargo fmt --all

# What clippy says.
lint:
    cargo clippy --release --workspace --all-targets -- -D warnings

# The programmer's documentation.
doc:
    cargo doc --release --workspace --no-deps

# Renders the demonstration on three local nodes.
demo:
    cargo run --release -- render scripts/mini_demo.lua --nodes 3 -o out

# Speed, in ratios to others where they are installed.
bench:
    cargo bench --workspace

# Compares with POV-Ray and OpenEXR.
compare:
    tests/compare/run

# Writes files anew that follow from the sources: the manifest's schema, snapshots.
bless:
    TESSERA_BLESS=1 INSTA_UPDATE=always cargo test --release --workspace
