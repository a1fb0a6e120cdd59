//! What the README promises to those who type its first command.

use std::{fs, os::unix::fs::symlink, path::Path};

use tessera_tests::farm::Program;

#[test]
fn the_first_command_renders_what_the_readme_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let readme = fs::read_to_string(root.join("README.md")).unwrap();
    let (_, block) = readme.split_once("```sh\n").unwrap();
    let command = block.lines().next().unwrap();
    let arguments = command.strip_prefix("cargo run --release -- ").expect("the first command runs the program");
    let program = Program::new(env!("CARGO_BIN_EXE_tessera-under-test"));
    for folder in ["scripts", "scenes"] {
        symlink(root.join(folder), program.path(folder)).unwrap();
    }
    let words: Vec<&str> = arguments.split_whitespace().chain(["--set", "width=64", "--set", "height=48"]).collect();
    let finished = program.run(&words);
    assert_eq!(finished.code, Some(0), "{command}: {}", finished.errors);
    let (_, after) = block.split_once("```").unwrap();
    let promised: Vec<&str> = after.split('`').skip(1).step_by(2).filter(|word| word.starts_with("out/")).take(3).collect();
    assert_eq!(promised.len(), 3, "the README names the files that it leaves");
    for file in promised {
        assert!(fs::metadata(program.path(file)).is_ok_and(|file| file.len() > 0), "{command} leaves no {file}");
    }
}
