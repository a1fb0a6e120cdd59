//! Who may do what, and what is said to those who may not: real processes with real keys.

use std::time::Duration;

use tessera_tests::farm::Program;

const BINARY: &str = env!("CARGO_BIN_EXE_tessera-under-test");

/// The exit code of what the farm does not let one do.
const DENIED: Option<i32> = Some(8);

fn issue(program: &Program, role: &str, name: &str) {
    let finished = program.run(&["keys", "issue", "--keys", "keys", "--role", role, "--name", name]);
    assert_eq!(finished.code, Some(0), "{}", finished.errors);
}

#[test]
fn each_role_does_what_it_may_and_nothing_else() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    for (role, name) in [("submitter", "anna"), ("submitter", "ben"), ("observer", "olga")] {
        issue(&program, role, name);
    }
    let (coordinator, address) = program.coordinator("keys", &[]);
    let run = |key: &str, words: &[&str]| {
        let key = format!("keys/{key}.pem");
        program.run(&[words, &["--coordinator", &address, "--keys", &key]].concat())
    };
    let (owner, other, observer, operator) = ("submitter-anna", "submitter-ben", "observer-olga", "operator-operator");
    assert_eq!(run(observer, &["submit", "job.lua"]).code, DENIED);
    let jobs = run(owner, &["submit", "job.lua"]);
    assert_eq!(jobs.code, Some(0), "{}", jobs.errors);
    let job = jobs.lines[0].as_str();
    for (key, words, code) in [
        (observer, &["status"][..], Some(0)),
        (other, &["status"], Some(0)),
        (observer, &["fetch", job, "-o", "out"], DENIED),
        (other, &["fetch", job, "-o", "out"], DENIED),
        // It is theirs, and not done yet.
        (owner, &["fetch", job, "-o", "out"], Some(5)),
        (operator, &["fetch", job, "-o", "out"], Some(5)),
        (observer, &["list"], Some(0)),
        (other, &["delete", job], DENIED),
        (observer, &["cancel", job], DENIED),
        (other, &["cancel", job], DENIED),
        (owner, &["cancel", job], Some(0)),
        // A client's key is none of a node, and the other way round: said before anything is sent.
        ("node-attic", &["status"], Some(4)),
        ("coordinator-coordinator", &["status"], Some(4)),
    ] {
        let finished = run(key, words);
        assert_eq!(finished.code, code, "{key} {words:?}: {}", finished.errors);
        if code == DENIED {
            assert!(finished.errors.contains(key.split('-').next_back().unwrap()), "{}", finished.errors);
        }
    }
    let second = run(other, &["submit", "job.lua"]);
    assert_eq!(run(operator, &["cancel", &second.lines[0]]).code, Some(0), "an operator ends anybody's job");
    assert_eq!(program.start(&["node", "--coordinator", &address, "--keys", &format!("keys/{owner}.pem")]).finish().code, Some(4));
    let log = coordinator.kill().errors;
    assert!(log.contains("observer olga may not submit jobs"), "{log}");
    assert!(log.contains("submitter ben may cancel jobs of its own alone"), "{log}");
}

#[test]
fn a_client_of_another_farm_is_told_what_to_do() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    program.make_keys("other", &[]);
    let (_coordinator, address) = program.coordinator("keys", &[]);
    let finished = program.run(&["status", "--coordinator", &address, "--keys", "other"]);
    assert_eq!(finished.code, DENIED, "{}", finished.errors);
    assert!(finished.errors.contains("different farms") && finished.errors.contains("tessera keys issue"), "{}", finished.errors);
}

#[test]
fn renewed_keys_are_as_good_as_new() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &[]);
    let before = program.run(&["keys", "show", "keys/operator-operator.pem"]).lines;
    // A certificate tells the second in which it was made.
    std::thread::sleep(Duration::from_millis(1100));
    let renewed = program.run(&["keys", "renew", "--keys", "keys", "keys/operator-operator.pem", "keys/coordinator-coordinator.pem"]);
    assert_eq!(renewed.code, Some(0), "{}", renewed.errors);
    assert_eq!(renewed.lines.len(), 2);
    let after = program.run(&["keys", "show", "keys/operator-operator.pem"]).lines;
    assert!(before[0] == after[0] && before[2] != after[2], "{before:?} {after:?}");
    let (_coordinator, address) = program.coordinator("keys", &[]);
    program.wait_for_status(&address, "keys", |_| true);
}

/// The first process keeps its place, the second says why it has none, and neither disturbs the farm.
#[test]
fn two_processes_with_one_key_do_not_drive_each_other_out() {
    let program = Program::new(BINARY);
    program.make_keys("keys", &["attic"]);
    let (coordinator, address) = program.coordinator("keys", &[]);
    let first = program.node(&address, "keys/node-attic.pem");
    program.wait_for_status(&address, "keys", |status| status["nodes"][0]["state"] == "ready");
    let second = program.node(&address, "keys/node-attic.pem");
    second.wait_for_complaint("another process with the key of attic");
    std::thread::sleep(Duration::from_secs(2)); // for more attempts, of which nothing is said
    program.wait_for_status(&address, "keys", |status| status["nodes"][0]["state"] == "ready");
    let (second, coordinator) = (second.kill(), coordinator.kill());
    let first = first.kill();
    assert_eq!(second.errors.matches("another process").count(), 1, "said once, not at every attempt: {}", second.errors);
    assert!(!first.errors.contains("another process"), "{}", first.errors);
    assert_eq!(coordinator.errors.matches("a node joined").count(), 1, "{}", coordinator.errors);
}
