//! Memory: built and dropped scenes leave none behind. Alone in its file, hence in its process.
#![cfg(target_os = "linux")]
// What `--nocapture` shows.
#![allow(clippy::print_stdout)]

mod made;

use made::{Random, chaos};

/// The memory of this process in kilobytes.
fn resident() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find(|line| line.starts_with("VmRSS")).expect("it is there");
    line.split_whitespace().nth(1).and_then(|number| number.parse().ok()).expect("a number")
}

#[test]
fn ten_thousand_builds_and_drops_do_not_grow() {
    let shapes = chaos(&mut Random::new(51, 0), 0, 500);
    let mut after_first = 0;
    for round in 0..10_000 {
        let scene = shapes.build();
        assert!(scene.bytes() > 10_000);
        if round == 1000 {
            after_first = resident();
        }
    }
    // All of it would be 900 MB; an array of ten bytes a primitive would be 45.
    let grown = resident().saturating_sub(after_first);
    println!("grown by {grown} kB in 9000 builds and drops");
    assert!(grown < 4000, "grown by {grown} kB");
}
