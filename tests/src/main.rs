//! The binary `tessera` under the name by which integration tests find it: `env!("CARGO_BIN_EXE_tessera-under-test")`.

fn main() -> std::process::ExitCode {
    tessera_node::cli::main()
}
