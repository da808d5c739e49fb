//! The inputs of the fuzz targets and damaged copies of them, on a stable toolchain and in seconds.
//! What fuzzing found lies among them: see `tests/fuzzed`.

// What `--nocapture` shows.
#![allow(clippy::print_stdout)]

mod fuzzed;
mod made;

use std::fs;
use std::panic::catch_unwind;
use std::path::Path;
use std::time::Instant;

use fuzzed::{TARGETS, Target};
use made::Random;
use made::random::rounds;

/// The inputs of a target, in the order of their names.
fn seeds(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzzed").join(name);
    let entries = fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() >= 4, "{}: too few seeds", folder.display());
    files.iter().map(|file| fs::read(file).unwrap()).collect()
}

/// A seed with a few things wrong in it.
fn damaged(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].clone();
    for _ in 0..1 + random.below(6) {
        let (a, b) = (random.below(bytes.len() + 1), random.below(bytes.len() + 1));
        let range = a.min(b)..a.max(b).min(a.min(b) + 40);
        match random.below(8) {
            0 => bytes.truncate(a),
            1 => drop(bytes.drain(range)),
            2 => {
                let again = bytes[range].to_vec();
                bytes.splice(b..b, again);
            }
            // A part of any seed.
            3 | 4 => {
                let other = &seeds[random.below(seeds.len())];
                let from = random.below(other.len() + 1);
                let to = (from + random.below(60)).min(other.len());
                bytes.splice(a..a, other[from..to].iter().copied());
            }
            5 => {
                let number = random.pick(&["-1", "0", "1e39", "nan", "4294967296", "1e-45", "\r"]);
                bytes.splice(range, number.bytes());
            }
            6 => bytes.iter_mut().skip(a).take(1).for_each(|byte| *byte = random.next() as u8),
            _ => {
                bytes.iter_mut().skip(a).take(1).for_each(|byte| *byte ^= 1 << random.below(8));
            }
        }
    }
    bytes
}

fn try_all(number: usize, usual: u64) {
    let (name, target): (&str, Target) = TARGETS[number];
    let seeds = seeds(name);
    seeds.iter().for_each(|seed| target(seed));
    target(b"");
    let start = Instant::now();
    // One after the other: a picture waits for threads of its own, and a test on a pool would take
    // up another input meanwhile, and another, until its stack is full.
    for round in rounds(usual) {
        let bytes = damaged(&mut Random::new(70 + number as u64, round), &seeds);
        if catch_unwind(|| target(&bytes)).is_err() {
            let text = String::from_utf8_lossy(&bytes).into_owned();
            panic!("{name}, round {round}: {bytes:?}\n{text}");
        }
    }
    println!("{name}: damaged files {:?} in {:.1?}", rounds(usual), start.elapsed());
}

#[test]
fn scene_files() {
    try_all(0, 10_000);
}

#[test]
fn obj_files() {
    try_all(1, 20_000);
}

#[test]
fn mtl_files() {
    try_all(2, 1_500);
}

#[test]
fn geometries() {
    try_all(3, 10_000);
}

#[test]
fn ply_files() {
    try_all(4, 20_000);
}
