//! octray and Embree 4 in one process, on the same rays, in turns.
//!
//! `cargo bench --bench embree -- --help` says how to choose scenes, rays and threads. Embree is
//! loaded at run time from an installed `embreex` package or from `OCTRAY_EMBREE_LIB`; without it
//! there is nothing to compare and the program says so. Each of Embree's ways to trace the rays has
//! a qualifying run; the best three then take turns with octray. A row's ratio is the median, over
//! the turns, of octray's rate divided by that of Embree's best call. No figure is printed for
//! hits that were not checked in the same run: octray against its scalar reference, and each call
//! of Embree against octray.

#![allow(clippy::print_stdout, clippy::print_stderr)]

mod agreement;
mod api;
mod builds;
mod calls;
mod clock;
mod contender;
mod engine;
mod library;
mod models;
mod options;
mod packets;
mod report;
mod turns;

use std::process::ExitCode;
use std::time::Instant;

use octray::workload::{Kind, Look, Model, Query, Stage, Viewpoint, Workload};
use octray::{HitBatch, Scene};

use crate::calls::Call;
use crate::clock::Clock;
use crate::contender::{Answers, Visibility};
use crate::engine::{BuildMode, Device, EmbreeScene};
use crate::options::{Options, Rays};
use crate::report::Report;
use crate::turns::Field;

fn main() -> ExitCode {
    let options = Options::from_command_line();
    let device = if options.octray_only {
        None
    } else {
        match library::load().and_then(|(api, path)| Ok((Device::new(api, 0)?, path))) {
            Ok((device, path)) => {
                eprintln!(
                    "Embree {} from {}, packets of {}",
                    device.version(),
                    path.file_name().unwrap_or_default().to_string_lossy(),
                    device.native_width()
                );
                Some(device)
            }
            Err(why) => {
                // Nothing is wrong with octray: benches must run where there is no Embree.
                eprintln!("{why}");
                return ExitCode::SUCCESS;
            }
        }
    };
    match run(&options, device.as_ref()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options, device: Option<&Device>) -> Result<(), String> {
    if options.builds {
        return models::wanted(options).try_for_each(|model| builds::measure(options, &model?));
    }
    let mut pools = Vec::new();
    for &threads in &options.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pools.push(pool.map_err(|error| error.to_string())?);
    }
    pools.dedup_by_key(|pool| pool.current_num_threads());
    let mut report = Report::new(options, device);
    for model in models::wanted(options) {
        measure_model(options, device, &pools, &model?, &mut report)?;
    }
    report.finish()
}

fn measure_model(
    options: &Options,
    device: Option<&Device>,
    pools: &[rayon::ThreadPool],
    model: &Model,
    report: &mut Report<'_>,
) -> Result<(), String> {
    let wanted: Vec<_> = options
        .workload
        .iter()
        .filter(|rays| options.wants_row(&model.name, &rays.kind.to_string()))
        .collect();
    if wanted.is_empty() {
        return Ok(());
    }
    let start = Instant::now();
    let scene = model.scene().map_err(|error| error.to_string())?;
    let build_time = start.elapsed();
    let modes =
        BuildMode::ALL.into_iter().filter(|mode| !options.one_build || *mode == BuildMode::ALL[0]);
    let embree = match device {
        None => Vec::new(),
        Some(device) => modes
            .map(|mode| EmbreeScene::build(device, model, mode, Clock::Wall))
            .collect::<Result<Vec<_>, _>>()?,
    };
    report.model(model, build_time, &embree);

    for look in &options.look {
        let stage = look.of(&model.stage);
        let name = match look {
            Look::Framed => model.name.clone(),
            _ => format!("{} {look}", model.name),
        };
        let view = viewpoint(options, &scene, &stage, embree.last())?;
        measure_view(options, pools, (&scene, &embree), (&name, &view), &wanted, report);
    }
    Ok(())
}

/// The stage's view; its primary hits are Embree's if octray is not to be measured.
fn viewpoint<'a>(
    options: &Options,
    scene: &'a Scene,
    stage: &Stage,
    embree: Option<&EmbreeScene<'_>>,
) -> Result<Viewpoint<'a>, String> {
    let (width, height) = options.size;
    let view = match embree {
        Some(embree) if options.embree_only => {
            Viewpoint::with_hits(scene, stage, width, height, options.seed, |rays| {
                let workload = Workload {
                    name: Kind::Primary.to_string(),
                    rays: rays.clone(),
                    query: Query::Intersect,
                };
                let mut answers = Answers::new(&workload);
                let call = Call { mode: embree.mode, width: 1, coherent: false, packed: false };
                call.contender(embree).trace(rays, &mut answers, true);
                match answers {
                    Answers::Hits(hits) => hits,
                    Answers::Occluded(_) => HitBatch::default(),
                }
            })
        }
        _ => Viewpoint::new(scene, stage, width, height, options.seed),
    };
    view.map_err(|error| error.to_string())
}

/// Measures the workloads of one view.
fn measure_view(
    options: &Options,
    pools: &[rayon::ThreadPool],
    (scene, embree): (&Scene, &[EmbreeScene<'_>]),
    (name, view): (&str, &Viewpoint<'_>),
    wanted: &[&Rays],
    report: &mut Report<'_>,
) {
    for rays in wanted {
        let mut workload = view.workload(rays.kind);
        if rays.shuffled {
            workload = workload.shuffled(options.seed);
        }
        if workload.rays.is_empty() {
            continue;
        }
        let shadows = if rays.shuffled { None } else { view.shadow_points(rays.kind) };
        let visibility = shadows.as_ref().map(|points| Visibility { scene, points });
        for pool in pools {
            let threads = pool.current_num_threads();
            let field = Field {
                scene,
                embree,
                workload: &workload,
                visibility,
                parallel: threads > 1,
                turns: options.turns,
                clock: if options.cpu_time && threads == 1 { Clock::Cpu } else { Clock::Wall },
            };
            let mut calls = Vec::new();
            // Inside the pool, so that both engines use its threads and no others.
            let mut row = if options.embree_only {
                pool.install(|| field.measure_embree(&mut calls))
            } else {
                pool.install(|| field.measure(&mut calls))
            };
            (row.scene, row.threads) = (name.to_owned(), threads);
            report.row(row, &calls);
        }
    }
}
