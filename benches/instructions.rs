//! How many instructions a ray takes: a figure that no other process on the machine disturbs, so that a
//! change of one percent shows. `benches/LOG.md` has the last ones.
//!
//! ```sh
//! RUSTFLAGS="-C target-cpu=x86-64-v3" cargo bench --bench instructions --target-dir target/x86-64-v3
//! ```
//!
//! The program runs itself under `valgrind --tool=callgrind`, once for each kind of rays, and counts
//! nothing but the query. Valgrind knows no AVX-512, hence the flags: these are the instructions of
//! registers of eight lanes. Two runs of one build differ by less than one in a thousand. Where there is
//! no Valgrind, or the build is one that it can't run, that is said and nothing is counted.

// Output for people is what a bench is for.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::process::{Command, ExitCode};

use clap::Parser;
use octray::workload::{Effort, Kind, Model, Path, Query, Viewpoint, Workload, measure, scenes};
use octray::{HitBatch, Scene};

/// How many instructions a ray takes, by Valgrind.
#[derive(Parser)]
struct Options {
    /// Traces one kind of rays, the last time in [`counted`]: what the program calls itself with.
    #[arg(long, hide = true)]
    one: Option<Kind>,
    /// Everything small, without Valgrind: does it run?
    #[arg(long)]
    test: bool,
    /// What cargo passes.
    #[arg(long, hide = true)]
    bench: bool,
}

const KINDS: [Kind; 5] = [Kind::Primary, Kind::Mirror, Kind::Hard, Kind::Diffuse, Kind::Ao];

/// A terrain of so many triangles, seen through so many pixels along each side.
struct Size {
    triangles: usize,
    side: usize,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let size = match options.test {
        true => Size { triangles: 500, side: 16 },
        false => Size { triangles: 10_000, side: 64 },
    };
    if options.test {
        check(&size);
        return ExitCode::SUCCESS;
    }
    let done = match options.one {
        Some(kind) => {
            one(kind, &size);
            Ok(())
        }
        None => all(&size),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::FAILURE
        }
    }
}

fn all(size: &Size) -> Result<(), String> {
    if cfg!(target_feature = "avx512f") {
        println!("nothing is counted: Valgrind can't run AVX-512. Build for less:");
        println!(
            "RUSTFLAGS=\"-C target-cpu=x86-64-v3\" cargo bench --bench instructions \
             --target-dir target/x86-64-v3"
        );
        return Ok(());
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("nothing is counted: there is no valgrind here");
        return Ok(());
    }
    // The answers must be right before what they take counts.
    check(size);
    println!("| rays | how many | instructions a ray |");
    println!("|---|---|---|");
    let model = scenes::terrain(size.triangles);
    let scene = model.scene().map_err(|error| error.to_string())?;
    for kind in KINDS {
        let rays = workload(&scene, &model, size, kind).rays.len();
        println!("| {kind} | {rays} | {:.1} |", instructions(kind)? as f64 / rays as f64);
    }
    Ok(())
}

/// The instructions of one query for all rays of a kind.
fn instructions(kind: Kind) -> Result<u64, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null", "--collect-atstart=no"])
        .arg(concat!("--toggle-collect=*", module_path!(), "*counted*"))
        .arg(program)
        .args(["--one", &kind.to_string()])
        .output()
        .map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(format!("valgrind failed:\n{said}"));
    }
    collected(&said).ok_or_else(|| format!("what valgrind says is not understood:\n{said}"))
}

/// The sum at the end of what callgrind says; `None` if there is none, or nothing was counted.
fn collected(said: &str) -> Option<u64> {
    let line = said.lines().find_map(|line| line.split_once("Collected : "))?;
    line.1.trim().parse().ok().filter(|&count| count > 0)
}

/// Traces the rays twice, so that what is done only once is done.
fn one(kind: Kind, size: &Size) {
    let model = scenes::terrain(size.triangles);
    let scene = model.scene().expect("the made scenes are valid");
    let workload = workload(&scene, &model, size, kind);
    let mut answers = Answers::new(&workload);
    answers.ask(&scene, &workload);
    counted(&mut answers, &scene, &workload);
}

/// What callgrind counts, which finds it by its name.
#[inline(never)]
fn counted(answers: &mut Answers, scene: &Scene, workload: &Workload) {
    answers.ask(scene, workload);
}

struct Answers {
    hits: HitBatch,
    occluded: Vec<bool>,
}

impl Answers {
    fn new(workload: &Workload) -> Self {
        let count = workload.rays.len();
        Self { hits: HitBatch::new(count), occluded: vec![false; count] }
    }

    fn ask(&mut self, scene: &Scene, workload: &Workload) {
        let rays = workload.rays.as_rays();
        let asked = match workload.query {
            Query::Intersect => scene.intersect_batch(rays, self.hits.as_hits()),
            Query::Occluded => scene.occluded_batch(rays, &mut self.occluded),
        };
        asked.expect("there are as many answers as rays");
    }
}

fn workload(scene: &Scene, model: &Model, size: &Size, kind: Kind) -> Workload {
    let view = Viewpoint::new(scene, &model.stage, size.side, size.side, 1);
    view.expect("so are their cameras").workload(kind)
}

/// All kinds have rays, which are answered as the reference answers them.
fn check(size: &Size) {
    let model = scenes::terrain(size.triangles);
    let scene = model.scene().expect("the made scenes are valid");
    for kind in KINDS {
        let workload = workload(&scene, &model, size, kind);
        assert!(workload.rays.len() > size.side, "{kind}");
        let once = Effort { seconds: 0.0, runs: 1 };
        measure(&scene, &workload, Path::Batch, once).expect("as the reference");
        let mut answers = Answers::new(&workload);
        counted(&mut answers, &scene, &workload);
    }
    assert_eq!(collected("==1== Events    : Ir\n==1== Collected : 4711\n"), Some(4711));
    assert_eq!(collected("==1== Collected : 0\n"), None);
}
