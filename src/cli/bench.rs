//! `octray bench`: how many rays a second the queries make on a scene.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use octray::scene::Loaded;
use octray::workload::{
    Bar, BarChart, Effort, Kind, Measurement, Model, Path, Stage, Viewpoint, measure,
};
use octray::{BuildQuality, InstructionSets, Scene};

use super::args::BuildArg;
use super::load::{Loading, load};
use super::{Stop, answer, say};

/// What is measured when nothing is asked for.
const USUAL: &str = "primary,mirror,diffuse,hard,soft16,ao";

#[derive(Args)]
pub(super) struct BenchArgs {
    /// The scene: a .toml file with its own camera, or an .obj or .ply file, which is put on a ground
    /// quad
    scene: PathBuf,
    /// Kinds of rays: primary, mirror, diffuse, hard, ao, and soft, near, huge, grazing and many with a
    /// number of samples
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_value = USUAL)]
    workload: Vec<Kind>,
    /// Pixels across and down
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = super::args::size)]
    size: (u32, u32),
    /// Threads, beside one; 0 for one a logical core
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Seconds for each figure, at least
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    seconds: f64,
    /// How much work goes into the tree [default: what the scene says, else balanced]
    #[arg(long, value_name = "QUALITY", value_enum)]
    build: Option<BuildArg>,
    /// What the samples derive from
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// JSON on stdout in place of the table
    #[arg(long)]
    json: bool,
    /// Also write a bar chart
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
}

pub(super) fn run(args: &BenchArgs) -> Result<(), Stop> {
    let loaded = load(&args.scene, args.build, &Loading::default())?;
    loaded.warnings.iter().for_each(|warning| say(&format!("warning: {warning}")));
    let (scene, stage) = staged(args, loaded)?;
    let (width, height) = (args.size.0 as usize, args.size.1 as usize);
    let view = Viewpoint::new(&scene, &stage, width, height, args.seed).map_err(Stop::failed)?;
    let mut pools = Vec::new();
    for threads in [1, args.threads] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pools.push(pool.map_err(Stop::failed)?);
    }
    pools.dedup_by_key(|pool| pool.current_num_threads());
    let effort = Effort { seconds: args.seconds, ..Effort::default() };

    let mut measured = Vec::new();
    for &kind in &args.workload {
        let workload = view.workload(kind);
        if workload.rays.is_empty() {
            say(&format!("warning: no primary ray hits, so there are no {kind} rays"));
            continue;
        }
        for path in Path::ALL {
            for pool in &pools {
                let result = pool.install(|| measure(&scene, &workload, path, effort));
                measured.push(result.map_err(Stop::failed)?);
            }
        }
    }
    if let Some(path) = &args.plot {
        std::fs::write(path, chart(&measured).to_svg())
            .map_err(|error| Stop::failed(format!("{}: {error}", path.display())))?;
    }
    answer(&if args.json { json(args, &scene, &measured) } else { table(&measured) })
}

/// The scene and where its rays come from.
fn staged(args: &BenchArgs, loaded: Loaded) -> Result<(Scene, Stage), Stop> {
    let is_mesh = args
        .scene
        .extension()
        .is_some_and(|end| ["obj", "ply"].iter().any(|mesh| end.eq_ignore_ascii_case(mesh)));
    if !is_mesh {
        let stage = Stage::of_scene(&loaded.scene, loaded.camera);
        return Ok((loaded.scene, stage));
    }
    // As everywhere where meshes are measured, so that figures compare.
    let name = args.scene.file_stem().unwrap_or_default().to_string_lossy();
    let model = Model::triangles_on_ground(&name, &loaded.scene);
    let mut builder = model.builder();
    builder.set_quality(args.build.map_or_else(BuildQuality::default, BuildQuality::from));
    Ok((builder.build().map_err(Stop::failed)?, model.stage))
}

fn table(measured: &[Measurement]) -> String {
    let sets = InstructionSets::detect();
    let mut text = format!("million rays a second; built for {}\n", sets.build.join(" "));
    if let Some(command) = sets.rebuild_command() {
        let _ = writeln!(text, "the CPU has {} as well: {command}", sets.unused().join(" "));
    }
    text.push_str("workload  path       threads      rays   hit %    median   slowest   fastest\n");
    for one in measured {
        let _ = writeln!(
            text,
            "{:<9} {:<10} {:>7} {:>9} {:>7.1} {:>9.3} {:>9.3} {:>9.3}",
            one.workload,
            one.path.name(),
            one.threads,
            one.rays,
            100.0 * one.hits as f64 / one.rays.max(1) as f64,
            one.median,
            one.low,
            one.high
        );
    }
    visits(&mut text, measured);
    text
}

/// What a ray visits in the mean, if this build counts it.
fn visits(text: &mut String, measured: &[Measurement]) {
    let counted: Vec<_> =
        measured.iter().filter_map(|one| Some((one, one.visits.as_ref()?))).collect();
    if counted.is_empty() {
        return;
    }
    text.push_str(
        "visits of a batch, by ray; boxes and primitives are those of tiles, by group of rays\n",
    );
    text.push_str("workload     alone   nodes  leaves   boxes primitives     met\n");
    for (one, visits) in counted {
        let by_ray = |count: u64| count as f64 / one.rays.max(1) as f64;
        let _ = writeln!(
            text,
            "{:<9} {:>8.3} {:>7.3} {:>7.3} {:>7.3} {:>10.3} {:>7.3}",
            one.workload,
            by_ray(visits.singles),
            by_ray(visits.nodes),
            by_ray(visits.leaves),
            by_ray(visits.box_groups),
            by_ray(visits.primitive_groups),
            by_ray(visits.met_groups),
        );
    }
}

fn json(args: &BenchArgs, scene: &Scene, measured: &[Measurement]) -> String {
    let sets = InstructionSets::detect();
    let json = serde_json::json!({
        "scene": args.scene.display().to_string(),
        "primitives": scene.bvh().stats().primitives,
        "size": [args.size.0, args.size.1],
        "seed": args.seed,
        "instruction_sets": { "build": sets.build, "cpu": sets.cpu },
        "measurements": measured,
    });
    format!("{json:#}\n")
}

fn chart(measured: &[Measurement]) -> BarChart {
    let mut chart = BarChart::new("octray: million rays a second");
    for one in measured.iter().filter(|one| one.path != Path::Reference) {
        let name = format!("{}, {} threads", one.path.name(), one.threads);
        let (value, low, high) = (one.median, one.low, one.high);
        chart.push(&one.workload, Bar { name, value, low, high });
    }
    chart
}
