//! Keys come and go while the farm runs: joining with tokens, renewal, revocation.

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;
use tessera_tests::farm::{Finished, Program};

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");
const DENIED: Option<i32> = Some(8);

fn good(finished: Finished) -> Finished {
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
    finished
}

/// Writes a join token into a file.
fn token(program: &Program, file: &str, more: &[&str]) {
    good(program.run(&[&["keys", "token", "--keys", "keys", "-o", file], more].concat()));
}

fn join(program: &Program, address: &str, file: &str, more: &[&str]) -> Finished {
    program.run(&[&["keys", "join", "--coordinator", address, "--token", file, "-o", "joined"], more].concat())
}

fn ready(status: &Value, name: &str) -> bool {
    status["nodes"].as_array().is_some_and(|nodes| nodes.iter().any(|node| node["name"] == name && node["state"] == "ready"))
}

#[test]
fn a_machine_with_a_token_joins_once_and_its_key_stays_with_it() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    let (coordinator, address) = program.coordinator("keys", &["--issuer", "keys"]);
    token(&program, "one", &["--role", "node"]);
    assert_eq!(fs::metadata(program.path("one")).unwrap().permissions().mode() & 0o777, 0o600);
    let joined = good(join(&program, &address, "one", &["--name", "cellar"]));
    assert_eq!(joined.lines, ["joined/node-cellar.pem"]);
    assert_eq!(fs::metadata(program.path("joined/node-cellar.pem")).unwrap().permissions().mode() & 0o777, 0o600);
    let _node = program.node(&address, "joined/node-cellar.pem");
    program.wait_for_status(&address, "keys", |status| ready(status, "cellar"));
    // It is used up, and stays so when the coordinator dies and comes back.
    let again = join(&program, &address, "one", &["--name", "roof"]);
    assert!(again.code == DENIED && again.errors.contains("used up"), "{again:?}");
    let log = coordinator.kill().errors;
    assert!(log.contains("used up") && log.contains("a key was certified"), "{log}");
    let (_coordinator, _) = program.coordinator_at(&address, "keys", &["--issuer", "keys"]);
    let again = join(&program, &address, "one", &["--name", "roof"]);
    assert!(again.code == DENIED && again.errors.contains("used up"), "{again:?}");
    // No name that is taken is given away, but to who was given a token with it.
    token(&program, "two", &["--role", "node", "--uses", "2"]);
    let taken = join(&program, &address, "two", &["--name", "cellar"]);
    assert!(taken.code == DENIED && taken.errors.contains("there is a node cellar already"), "{taken:?}");
    fs::remove_file(program.path("joined/node-cellar.pem")).unwrap();
    token(&program, "three", &["--role", "node", "--name", "cellar"]);
    good(join(&program, &address, "three", &[]));
}

#[test]
fn tokens_are_for_one_role_and_a_while() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    program.make_keys("other", &[]);
    let (coordinator, address) = program.coordinator("keys", &["--issuer", "keys/issuer.pem"]);
    token(&program, "short", &["--role", "observer", "--name", "olga", "--valid", "1"]);
    std::thread::sleep(Duration::from_millis(2100));
    let late = join(&program, &address, "short", &[]);
    assert!(late.code == DENIED && late.errors.contains("expired"), "{late:?}");
    token(&program, "observer", &["--role", "observer", "--name", "olga"]);
    good(join(&program, &address, "observer", &[]));
    let submitted = program.run(&["submit", "job.lua", "--coordinator", &address, "--keys", "joined/observer-olga.pem"]);
    assert_eq!(submitted.code, DENIED, "{}", submitted.errors);
    assert_eq!(program.run(&["keys", "token", "--keys", "keys", "--role", "operator"]).code, Some(2), "operators do not join");
    // A token of another farm is not even shown to this one: the coordinator is not under the authority that it names.
    good(program.run(&["keys", "token", "--keys", "other", "--role", "node", "-o", "foreign"]));
    let foreign = join(&program, &address, "foreign", &["--name", "attic"]);
    assert!(foreign.code == DENIED && foreign.errors.contains("farm"), "{foreign:?}");
    assert!(!coordinator.kill().errors.contains("not made with the issuer"));
    // Without an issuer nobody joins, and it is said why.
    let (_coordinator, address) = program.coordinator("keys", &[]);
    token(&program, "good", &["--role", "node"]);
    let nobody = join(&program, &address, "good", &["--name", "attic"]);
    assert!(nobody.code == DENIED && nobody.errors.contains("takes no join tokens"), "{nobody:?}");
}

#[test]
fn a_token_comes_from_stdin_or_from_the_service_manager() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    let (_coordinator, address) = program.coordinator("keys", &["--issuer", "keys"]);
    fs::create_dir(program.path("credentials")).unwrap();
    token(&program, "credentials/join-token", &["--role", "node", "--uses", "2"]);
    let arguments = ["keys", "join", "--coordinator", &address, "-o", "joined", "--name"];
    let mut command = Command::new(BINARY);
    command.current_dir(program.folder.path()).args(arguments).arg("one").env("CREDENTIALS_DIRECTORY", "credentials").stdout(Stdio::null());
    assert!(command.status().unwrap().success());
    let input = fs::File::open(program.path("credentials/join-token")).unwrap();
    let mut command = Command::new(BINARY);
    command.current_dir(program.folder.path()).args(arguments).args(["two", "--token", "-"]).stdin(input).stdout(Stdio::null());
    assert!(command.status().unwrap().success());
    assert_eq!(fs::read_dir(program.path("joined")).unwrap().count(), 2);
}

#[test]
fn a_certificate_that_is_still_valid_gets_a_new_one_over_the_wire() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    let (_coordinator, address) = program.coordinator("keys", &["--issuer", "keys"]);
    let before = fs::read_to_string(program.path("keys/node-attic.pem")).unwrap();
    good(program.run(&["keys", "renew", "--coordinator", &address, "keys/node-attic.pem"]));
    let after = fs::read_to_string(program.path("keys/node-attic.pem")).unwrap();
    assert_ne!(before.lines().nth(1), after.lines().nth(1), "its key is a new one too");
    let _node = program.node(&address, "keys/node-attic.pem");
    program.wait_for_status(&address, "keys", |status| ready(status, "attic"));
    let operator = program.run(&["keys", "renew", "--coordinator", &address, "keys/operator-operator.pem"]);
    assert!(operator.code == DENIED && operator.errors.contains("authority"), "{operator:?}");
}

#[test]
fn who_is_revoked_is_sent_away_at_once_and_both_say_why() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic", "cellar"]);
    let (coordinator, address) = program.coordinator("keys", &[]);
    let node = program.node(&address, "keys/node-attic.pem");
    let _other = program.node(&address, "keys/node-cellar.pem");
    program.wait_for_status(&address, "keys/operator-operator.pem", |status| ready(status, "attic") && ready(status, "cellar"));
    let begin = Instant::now();
    good(program.run(&["keys", "revoke", "attic", "--list", "data/revoked", "--reason", "stolen from the attic"]));
    let status = program.wait_for_status(&address, "keys/operator-operator.pem", |status| !ready(status, "attic"));
    assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
    assert!(ready(&status, "cellar"), "nobody else is touched");
    node.wait_for_complaint("was revoked");
    let log = node.kill().errors;
    assert!(log.contains("the certificate of node attic was revoked: stolen from the attic"), "{log}");
    // A client is refused with its own exit code, and a coordinator that is started anew knows the list.
    good(program.run(&["keys", "issue", "--keys", "keys", "--role", "observer", "--name", "olga"]));
    let shown = program.run(&["keys", "show", "keys/observer-olga.pem"]).lines;
    let fingerprint = shown[2].trim().trim_start_matches("fingerprint ").to_owned();
    good(program.run(&["keys", "revoke", &fingerprint, "--list", "data/revoked"]));
    let log = coordinator.kill().errors;
    assert!(log.contains("stolen from the attic"), "{log}");
    let (_coordinator, _) = program.coordinator_at(&address, "keys", &[]);
    let olga = program.run(&["status", "--coordinator", &address, "--keys", "keys/observer-olga.pem"]);
    assert!(olga.code == DENIED && olga.errors.contains("was revoked"), "{olga:?}");
    // The name is free for a new key.
    fs::remove_file(program.path("keys/node-attic.pem")).unwrap();
    good(program.run(&["keys", "issue", "--keys", "keys", "--role", "node", "--name", "attic"]));
    let _node = program.node(&address, "keys/node-attic.pem");
    program.wait_for_status(&address, "keys/operator-operator.pem", |status| ready(status, "attic"));
}

#[test]
fn a_list_that_cannot_be_read_lets_nobody_in() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    fs::create_dir(program.path("data")).unwrap();
    fs::write(program.path("data/revoked"), "not a list\n").unwrap();
    let finished = program.run(&["coordinator", "--listen", "127.0.0.1:0", "--data", "data", "--keys", "keys"]);
    assert!(finished.code == Some(4) && finished.errors.contains("revoked:1:"), "{finished:?}");
    // One that breaks later leaves the last one in force.
    fs::remove_file(program.path("data/revoked")).unwrap();
    good(program.run(&["keys", "revoke", "attic", "--list", "data/revoked"]));
    let (coordinator, address) = program.coordinator("keys", &[]);
    fs::write(program.path("data/revoked"), "not a list\n").unwrap();
    coordinator.wait_for_complaint("the last one stays in force");
    program.node(&address, "keys/node-attic.pem").wait_for_complaint("was revoked");
}
