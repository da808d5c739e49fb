//! The table of `--builds`: how fast octray's and Embree's trees are built, each quality of each in
//! turns, how large they are, and how fast octray traces its own.

use std::time::Duration;

use octray::Scene;
use octray::bvh::BuildQuality;
use octray::workload::{Model, Viewpoint};

use crate::clock::Clock;
use crate::contender::{Answers, Contender, Octray};
use crate::engine::{BuildMode, Device, EmbreeScene, Quality};
use crate::library;
use crate::options::Options;
use crate::turns::median;

/// One builder.
#[derive(Clone, Copy, PartialEq)]
enum Builder {
    Octray(BuildQuality),
    Embree(Quality),
}

impl Builder {
    fn name(self) -> String {
        match self {
            Self::Octray(quality) => format!("octray {quality}"),
            Self::Embree(quality) => format!("Embree {}", quality.name()),
        }
    }
}

/// What is said of a builder on one number of threads.
struct Row {
    builder: Builder,
    /// Seconds, turn by turn.
    seconds: Vec<f64>,
    bytes: f64,
    /// The cost of the tree by the surface area heuristic, where it can be asked for.
    sah_cost: Option<f64>,
}

/// Measures one model.
pub(crate) fn measure(options: &Options, model: &Model) -> Result<(), String> {
    println!("\n{}: {} primitives", model.name, model.primitive_count());
    for &threads in &options.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| error.to_string())?;
        let clock = match pool.current_num_threads() {
            1 if options.cpu_time => Clock::Process,
            _ => Clock::Wall,
        };
        let rows = builds(options, model, threads, clock, &pool)?;
        print(model, pool.current_num_threads(), &rows);
    }
    rays(options, model)
}

fn builds(
    options: &Options,
    model: &Model,
    threads: usize,
    clock: Clock,
    pool: &rayon::ThreadPool,
) -> Result<Vec<Row>, String> {
    let device = match options.octray_only {
        true => None,
        false => library::load().and_then(|(api, _)| Device::new(api, threads)).ok(),
    };
    let ours = BuildQuality::ALL.map(Builder::Octray);
    let theirs = Quality::ALL.map(Builder::Embree);
    let builders = ours.into_iter().chain(theirs.into_iter().filter(|_| device.is_some()));
    let row = |builder| Row { builder, seconds: Vec::new(), bytes: 0.0, sah_cost: None };
    let mut rows: Vec<Row> = builders.map(row).collect();
    for turn in 0..=options.turns {
        for row in &mut rows {
            let time = match (row.builder, &device) {
                (Builder::Octray(quality), _) => {
                    let (scene, time) = build(model, quality, clock, pool)?;
                    row.bytes = scene.bytes() as f64;
                    row.sah_cost = Some(scene.bvh().stats().sah_cost);
                    time
                }
                (Builder::Embree(quality), Some(device)) => {
                    let mode = BuildMode { robust: false, quality };
                    let scene = EmbreeScene::build(device, model, mode, clock)?;
                    row.bytes = scene.tree_bytes as f64;
                    scene.build_time
                }
                (Builder::Embree(_), None) => unreachable!("there is a device for these rows"),
            };
            // The first turn warms up.
            if turn > 0 || options.test {
                row.seconds.push(time.as_secs_f64());
            }
        }
    }
    Ok(rows)
}

/// Builds a copy of the model, which is not timed.
fn build(
    model: &Model,
    quality: BuildQuality,
    clock: Clock,
    pool: &rayon::ThreadPool,
) -> Result<(Scene, Duration), String> {
    let mut builder = model.builder();
    builder.set_quality(quality);
    let running = clock.start();
    let scene = pool.install(|| builder.build()).map_err(|error| error.to_string())?;
    Ok((scene, Duration::from_secs_f64(running.seconds())))
}

fn print(model: &Model, threads: usize, rows: &[Row]) {
    let count = model.primitive_count() as f64;
    let yardsticks = [Quality::Medium, Quality::High];
    println!(
        "{:<16} {:>2} {:>9} {:>8} {:>8} {:>12} {:>12}",
        "builder", "th", "M/s", "bytes", "SAH", "/medium", "/high"
    );
    for row in rows {
        print!(
            "{:<16} {threads:>2} {:>9.2} {:>8.1} {:>8}",
            row.builder.name(),
            count / median(&row.seconds) / 1e6,
            row.bytes / count,
            row.sah_cost.map_or("-".into(), |cost| format!("{cost:.2}")),
        );
        for quality in yardsticks {
            let yardstick = rows.iter().find(|row| row.builder == Builder::Embree(quality));
            let ratio = yardstick.map(|yardstick| {
                let turns = yardstick.seconds.iter().zip(&row.seconds);
                median(&turns.map(|(theirs, ours)| theirs / ours).collect::<Vec<_>>())
            });
            print!(" {:>12}", ratio.map_or("-".into(), |ratio| format!("{ratio:.2}")));
        }
        println!();
    }
}

/// How fast octray traces its trees, on one thread.
fn rays(options: &Options, model: &Model) -> Result<(), String> {
    let clock = if options.cpu_time { Clock::Cpu } else { Clock::Wall };
    let pool = rayon::ThreadPoolBuilder::new().build().map_err(|error| error.to_string())?;
    let mut scenes = Vec::new();
    for quality in BuildQuality::ALL {
        scenes.push(build(model, quality, clock, &pool)?.0);
    }
    let (width, height) = options.size;
    let view = Viewpoint::new(&scenes[1], &model.stage, width, height, options.seed);
    let view = view.map_err(|error| error.to_string())?;
    println!("{:<17} {:>9} {:>9} {:>9}", "Mrays/s on", "fast", "balanced", "high");
    for rays in options.workload.iter().filter(|rays| !rays.shuffled) {
        let workload = view.workload(rays.kind);
        let mut rates = vec![Vec::new(); scenes.len()];
        let mut first: Option<Answers> = None;
        for turn in 0..=options.turns {
            for (scene, rates) in scenes.iter().zip(&mut rates) {
                let mut answers = Answers::new(&workload);
                let running = clock.start();
                Octray(scene).trace(&workload.rays, &mut answers, false);
                let rate = workload.rays.len() as f64 / running.seconds() / 1e6;
                match &first {
                    _ if turn > 0 => rates.push(rate),
                    Some(first) if *first != answers => {
                        return Err(format!("{}: the trees give different hits", workload.name));
                    }
                    Some(_) => {}
                    None => first = Some(answers),
                }
            }
        }
        print!("{:<17}", workload.name);
        for one in &rates {
            let to_balanced: Vec<f64> = one.iter().zip(&rates[1]).map(|(a, b)| a / b).collect();
            print!(" {:>9.2} ({:.2})", median(one), median(&to_balanced));
        }
        println!();
    }
    Ok(())
}
