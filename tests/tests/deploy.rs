//! The units against the program that they start.

use std::{fs, os::unix::net::UnixDatagram, path::Path, process::Command};

use tessera_tests::farm::{PATIENCE, Program};

/// Words of every `ExecStart=` of a unit, without the program itself.
fn command_line(unit: &str) -> Vec<String> {
    let lines = unit.lines().filter_map(|line| line.strip_prefix("ExecStart="));
    lines.flat_map(|line| line.split_whitespace().skip(1).map(str::to_owned)).collect()
}

#[test]
fn units_start_what_is_there_with_flags_that_it_knows() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("deploy");
    for name in ["tessera-coordinator.service", "tessera-node.service"] {
        let unit = fs::read_to_string(folder.join(name)).unwrap();
        let words = command_line(&unit);
        let help = Command::new(env!("CARGO_BIN_EXE_tessera-under-test")).args([&words[0], "--help"]).output().unwrap();
        assert!(help.status.success(), "{name}: there is no `tessera {}`", words[0]);
        let help = String::from_utf8(help.stdout).unwrap();
        let known: Vec<_> = help.split(|c: char| !(c.is_alphanumeric() || c == '-')).collect();
        let flags: Vec<_> = words.iter().filter(|word| word.starts_with("--")).collect();
        assert!(!flags.is_empty());
        for flag in flags {
            assert!(known.contains(&flag.as_str()), "{name}: `tessera {}` has no {flag}", words[0]);
        }
        for promised in ["Type=notify", "Restart=always", "DynamicUser=yes", "LoadCredential="] {
            assert!(unit.contains(promised), "{name} lacks {promised}");
        }
    }
}

/// Starts a subcommand as a service manager would, and waits until it says that it is ready.
fn becomes_ready(program: &Program, arguments: &[&str]) {
    let path = program.path(arguments[0]).with_extension("socket");
    let manager = UnixDatagram::bind(&path).unwrap();
    manager.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut service = Command::new(env!("CARGO_BIN_EXE_tessera-under-test"))
        .current_dir(program.folder.path())
        .args(arguments)
        .env("NOTIFY_SOCKET", &path)
        .spawn()
        .unwrap();
    let mut message = [0; 256];
    let said = manager.recv(&mut message).map(|length| String::from_utf8_lossy(&message[..length]).into_owned());
    service.kill().unwrap();
    service.wait().unwrap();
    assert_eq!(said.unwrap().trim_end(), "READY=1", "{arguments:?}");
}

#[test]
fn services_say_when_they_are_ready() {
    let program = Program::new(env!("CARGO_BIN_EXE_tessera-under-test"));
    program.make_keys("keys", &["attic"]);
    becomes_ready(&program, &["coordinator", "--listen", "127.0.0.1:0", "--data", "data", "--keys", "keys"]);
    // No coordinator is there: the node waits for one, and is ready all the same.
    becomes_ready(&program, &["node", "--coordinator", "127.0.0.1:9", "--keys", "keys/node-attic.pem"]);
}
