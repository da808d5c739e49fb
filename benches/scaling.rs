//! How building and tracing grow with the scene: made terrains from a thousand to thirty million
//! triangles, each in a process of its own so that its peak of memory is its own.
//!
//! `cargo bench --bench scaling -- --svg docs/scaling.svg` prints the table of `docs/scaling.md`
//! and draws its chart; `--most N` stops at N triangles. One thread, timed by the CPU that it
//! gets. Where there is no `/proc`, there are no figures.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use clap::Parser;
use octray::workload::{Bar, BarChart, Kind, Part, Viewpoint, scenes};
use octray::{BuildQuality, HitBatch, SceneBuilder};
use serde::{Deserialize, Serialize};

/// Building and tracing made terrains of growing size.
#[derive(Parser)]
struct Options {
    /// The most triangles.
    #[arg(long, default_value_t = 30_000_000)]
    most: usize,
    /// The quality of the trees: fast, balanced or high.
    #[arg(long, default_value_t = BuildQuality::Balanced)]
    build: BuildQuality,
    /// Write a chart.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Measures one terrain and prints it as JSON: what the program calls itself with.
    #[arg(long, hide = true)]
    one: Option<usize>,
    /// Everything small: does it run?
    #[arg(long)]
    test: bool,
    /// What cargo passes.
    #[arg(long, hide = true)]
    bench: bool,
}

/// What is measured of one terrain.
#[derive(Serialize, Deserialize)]
struct Row {
    triangles: usize,
    /// Seconds of one build.
    build: f64,
    /// Bytes of the scene.
    scene: usize,
    /// The most memory that the process had while it built, the mesh included; of [`LARGE`] scenes.
    peak: Option<usize>,
    /// Million rays a second.
    primary: f64,
    diffuse: f64,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let done = match options.one {
        Some(triangles) => one(triangles, options.build),
        None => all(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::FAILURE
        }
    }
}

fn all(options: &Options) -> Result<(), String> {
    if cpu_seconds().is_err() {
        eprintln!("there is no /proc/thread-self/schedstat here: nothing is measured");
        return Ok(());
    }
    let most = if options.test { 1000 } else { options.most };
    let steps = [1, 3, 10, 30, 100, 300, 1000, 3000, 10_000, 30_000];
    let mut rows = Vec::new();
    println!("| triangles | M/s built | bytes a triangle | peak | primary | diffuse |");
    println!("|---|---|---|---|---|---|");
    for triangles in steps.map(|thousands| thousands * 1000) {
        if triangles > most {
            break;
        }
        let row = child(triangles, options.build)?;
        let count = row.triangles as f64;
        println!(
            "| {} | {:.2} | {:.1} | {} | {:.2} | {:.2} |",
            row.triangles,
            count / row.build / 1e6,
            row.scene as f64 / count,
            row.peak.map_or("-".into(), |peak| format!("{:.2}", peak as f64 / row.scene as f64)),
            row.primary,
            row.diffuse
        );
        rows.push(row);
    }
    if let Some(path) = &options.svg {
        let svg = chart(&rows).to_svg();
        fs::write(path, svg).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

/// Measures one terrain in a process of its own.
fn child(triangles: usize, build: BuildQuality) -> Result<Row, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let (triangles, build) = (triangles.to_string(), build.to_string());
    let output = Command::new(program).args(["--one", &triangles, "--build", &build]).output();
    let output = output.map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())
}

/// From so many triangles on the rest of the process is nothing beside the scene.
const LARGE: usize = 900_000;

/// How long rays are traced for a rate.
const LEAST_SECONDS: f64 = 0.5;

fn one(triangles: usize, quality: BuildQuality) -> Result<(), String> {
    // On this thread, whose clock is read.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    let _pool = pool.map_err(|error| error.to_string())?;
    let model = scenes::terrain(triangles);
    let (triangles, stage) = (model.primitive_count(), model.stage);
    // Small ones often: the clock ticks a few hundred times a second. Where the peak is asked for, only
    // once: what earlier builds have freed would be in it.
    let times = if triangles < LARGE { 2_000_000 / triangles } else { 0 };
    let mut builders = vec![model.builder(); times];
    builders.iter_mut().for_each(|builder| builder.set_quality(quality));
    let (builds, start) = (builders.len(), cpu_seconds()?);
    for builder in builders {
        builder.build().map_err(|error| error.to_string())?;
    }
    let often = (cpu_seconds()? - start) / builds as f64;
    let mut builder = SceneBuilder::new();
    builder.set_quality(quality);
    for part in model.parts {
        if let Part::Mesh(mesh) = part {
            builder.add_mesh(mesh, 0);
        }
    }
    // Forgets the peak so far, which was that of making the terrain.
    fs::write("/proc/self/clear_refs", "5").map_err(|error| error.to_string())?;
    let start = cpu_seconds()?;
    let scene = builder.build().map_err(|error| error.to_string())?;
    let once = cpu_seconds()? - start;
    let peak = peak_bytes()?;

    let view = Viewpoint::new(&scene, &stage, 512, 512, 1).map_err(|error| error.to_string())?;
    let rate = |kind| -> Result<f64, String> {
        let workload = view.workload(kind);
        let mut hits = HitBatch::new(workload.rays.len());
        // Long enough that the clock's ticks do not show.
        let (start, mut rounds) = (cpu_seconds()?, 0);
        loop {
            let traced = scene.intersect_batch(workload.rays.as_rays(), hits.as_hits());
            traced.map_err(|error| error.to_string())?;
            rounds += 1;
            let seconds = cpu_seconds()? - start;
            if seconds > LEAST_SECONDS {
                return Ok((rounds * workload.rays.len()) as f64 / seconds / 1e6);
            }
        }
    };
    let row = Row {
        triangles,
        build: if builds > 0 { often } else { once },
        scene: scene.bytes(),
        peak: (triangles >= LARGE).then_some(peak),
        primary: rate(Kind::Primary)?,
        diffuse: rate(Kind::Diffuse)?,
    };
    println!("{}", serde_json::to_string(&row).map_err(|error| error.to_string())?);
    Ok(())
}

/// The time for which this thread has run.
fn cpu_seconds() -> Result<f64, String> {
    let text = fs::read_to_string("/proc/thread-self/schedstat");
    let text = text.map_err(|error| error.to_string())?;
    let nanoseconds = text.split(' ').next().and_then(|first| first.parse::<f64>().ok());
    Ok(nanoseconds.ok_or("what /proc says of the thread is not understood")? * 1e-9)
}

/// The most memory that this process had.
fn peak_bytes() -> Result<usize, String> {
    let text = fs::read_to_string("/proc/self/status").map_err(|error| error.to_string())?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let number = line.and_then(|line| line.trim().split(' ').next()?.parse::<usize>().ok());
    Ok(number.ok_or("what /proc says of the process is not understood")? * 1024)
}

/// A group of bars for each figure, a bar for each size.
fn chart(rows: &[Row]) -> BarChart {
    let mut chart = BarChart::new("terrains on one thread, from a thousand triangles on");
    for row in rows {
        let count = row.triangles as f64;
        let name = match row.triangles {
            many @ 950_000.. => format!("{:.0} M", many as f64 / 1e6),
            few => format!("{:.0} k", few as f64 / 1e3),
        };
        let peak = row.peak.map(|peak| peak as f64 / row.scene as f64);
        let figures = [
            ("million triangles built a second", Some(count / row.build / 1e6)),
            ("million primary rays a second", Some(row.primary)),
            ("million diffuse rays a second", Some(row.diffuse)),
            ("peak of memory, in final scenes", peak),
        ];
        for (group, value) in figures {
            let Some(value) = value else { continue };
            chart.push(group, Bar { name: name.clone(), value, low: value, high: value });
        }
    }
    chart
}
