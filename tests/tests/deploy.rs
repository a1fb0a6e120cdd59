//! The units against the program that they start.

use std::{
    fs,
    os::unix::net::UnixDatagram,
    path::{Path, PathBuf},
    process::Command,
    time::Duration,
};

use tessera_tests::farm::{PATIENCE, Program};

const UNITS: [&str; 2] = ["tessera-coordinator.service", "tessera-node@.service"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("deploy/systemd")
}

/// Words of every `ExecStart=` of a unit, without the program itself.
fn command_line(unit: &str) -> Vec<String> {
    let lines = unit.lines().filter_map(|line| line.strip_prefix("ExecStart="));
    lines.flat_map(|line| line.split_whitespace().skip(1).map(str::to_owned)).collect()
}

#[test]
fn units_start_what_is_there_with_flags_that_it_knows() {
    for name in UNITS {
        let unit = fs::read_to_string(folder().join(name)).unwrap();
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
        for promised in ["Type=notify", "Restart=always", "DynamicUser=yes", "LoadCredential=", "WatchdogSec="] {
            assert!(unit.contains(promised), "{name} lacks {promised}");
        }
    }
}

/// systemd's own opinion of the units: nothing to complain of, and an exposure of at most 1.0 of 10.
#[test]
fn units_are_right_and_tight() {
    let analyze = |arguments: &[&str], units: &[PathBuf]| Command::new("systemd-analyze").args(arguments).args(units).output();
    if analyze(&["--version"], &[]).is_err() {
        return eprintln!("skipped: no systemd-analyze here");
    }
    let installed = tempfile::tempdir().unwrap();
    let units = UNITS.map(|name| {
        let unit = fs::read_to_string(folder().join(name)).unwrap();
        let program = format!("ExecStart={} ", env!("CARGO_BIN_EXE_tessera-under-test"));
        let path = installed.path().join(name);
        fs::write(&path, unit.replace("ExecStart=tessera ", &program)).unwrap();
        path
    });
    fs::copy(folder().join("tessera-coordinator.socket"), installed.path().join("tessera-coordinator.socket")).unwrap();
    for arguments in [&["verify"][..], &["security", "--offline=true", "--threshold=10"]] {
        let said = analyze(arguments, &units).unwrap();
        let (table, complaints) = (String::from_utf8_lossy(&said.stdout), String::from_utf8_lossy(&said.stderr));
        assert!(said.status.success() && complaints.is_empty(), "systemd-analyze {arguments:?}: {complaints}\n{table}");
    }
}

/// What a service manager hears of a subcommand until it has heard enough.
fn heard(program: &Program, arguments: &[&str], watchdog: Option<Duration>, enough: impl Fn(&[String]) -> bool) -> Vec<String> {
    let path = program.path(arguments[0]).with_extension("socket");
    let manager = UnixDatagram::bind(&path).unwrap();
    manager.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut service = Command::new(env!("CARGO_BIN_EXE_tessera-under-test"));
    service.current_dir(program.folder.path()).args(arguments).env("NOTIFY_SOCKET", &path);
    if let Some(patience) = watchdog {
        service.env("WATCHDOG_USEC", patience.as_micros().to_string());
    }
    let mut service = service.spawn().unwrap();
    let (mut said, mut message) = (Vec::new(), [0; 256]);
    while !enough(&said) {
        match manager.recv(&mut message) {
            Ok(length) => said.push(String::from_utf8_lossy(&message[..length]).trim_end().to_owned()),
            Err(_) => break,
        }
    }
    service.kill().unwrap();
    service.wait().unwrap();
    fs::remove_file(path).unwrap();
    said
}

#[test]
fn services_say_when_they_are_ready() {
    let program = Program::new(env!("CARGO_BIN_EXE_tessera-under-test"));
    program.make_keys("keys", &["attic"]);
    for arguments in [
        &["coordinator", "--listen", "127.0.0.1:0", "--data", "data", "--keys", "keys"][..],
        // No coordinator is there: the node waits for one, and is ready all the same.
        &["node", "--coordinator", "127.0.0.1:9", "--keys", "keys/node-attic.pem"],
    ] {
        assert_eq!(heard(&program, arguments, None, |said| !said.is_empty()), ["READY=1"], "{arguments:?}");
    }
}

#[test]
fn services_that_work_feed_their_watchdog() {
    let program = Program::new(env!("CARGO_BIN_EXE_tessera-under-test"));
    program.make_keys("keys", &["attic"]);
    let (_coordinator, address) = program.coordinator("keys", &[]);
    for arguments in [
        &["coordinator", "--listen", "127.0.0.1:0", "--data", "other", "--keys", "keys"][..],
        &["node", "--coordinator", &address, "--keys", "keys/node-attic.pem"],
    ] {
        let fed = |said: &[String]| said.iter().filter(|word| *word == "WATCHDOG=1").count();
        let said = heard(&program, arguments, Some(Duration::from_millis(400)), |said| fed(said) >= 5);
        assert!(fed(&said) >= 5, "{arguments:?}: {said:?}");
    }
}
