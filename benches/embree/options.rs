//! The command line.

use std::path::PathBuf;

use clap::Parser;
use octray::workload::{Kind, Look, UnknownKind};

/// octray and Embree on the same rays, in turns.
#[derive(Clone, Debug, Parser)]
pub(crate) struct Options {
    /// Scenes: bunny (the OBJ in OCTRAY_BENCH_MESH), terrain, dense, atrium, sphereflake, mixed; if asked
    /// for by name also grating.
    #[arg(long, value_delimiter = ',')]
    pub(crate) scene: Vec<String>,
    /// Kinds of rays: primary, mirror, diffuse, hard, soft16 and other numbers, ao; soft shadows of
    /// other lights near16, huge16, grazing16, many16; with `-shuffled` behind it in random order.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "primary,mirror,diffuse,hard,soft16,soft64,soft256,ao,primary-shuffled"
    )]
    pub(crate) workload: Vec<Rays>,
    /// How scenes are looked at: framed, as their tables have it, or near, far, inside, grazing.
    #[arg(long, value_delimiter = ',', default_value = "framed")]
    pub(crate) look: Vec<Look>,
    /// Pixels: one number, or width x height.
    #[arg(long, default_value = "1024", value_parser = parse_size)]
    pub(crate) size: (usize, usize),
    /// Threads: numbers, or `all`.
    #[arg(long, value_delimiter = ',', default_value = "1,all", value_parser = parse_threads)]
    pub(crate) threads: Vec<usize>,
    /// How often the engines take turns.
    #[arg(long, default_value_t = 9)]
    pub(crate) turns: usize,
    /// How large the made scenes are, in thousands of triangles; spheres are a tenth of it.
    #[arg(long, default_value_t = 1000)]
    pub(crate) kilotriangles: usize,
    /// What the samples derive from.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// octray alone, checked against its reference: for quick looks.
    #[arg(long, conflicts_with = "embree_only")]
    pub(crate) octray_only: bool,
    /// Embree alone, checked against octray's reference.
    #[arg(long)]
    pub(crate) embree_only: bool,
    /// Only Embree's fast scene of medium quality: starts sooner.
    #[arg(long)]
    pub(crate) one_build: bool,
    /// In place of the races of rays: how fast trees are built, by the fastest, the usual and the
    /// best build of each engine, and how fast octray traces its own.
    #[arg(long)]
    pub(crate) builds: bool,
    /// Time one thread by the CPU that it gets and not by the wall: for machines that others use
    /// too. Not for figures that are shown to anybody.
    #[arg(long)]
    pub(crate) cpu_time: bool,
    /// Also print what each of Embree's calls made in its qualifying run.
    #[arg(long)]
    pub(crate) calls: bool,
    /// JSON in place of the tables.
    #[arg(long)]
    pub(crate) json: bool,
    /// Write a bar chart of the ratios.
    #[arg(long, value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
    /// Everything once and small: does it run?
    #[arg(long)]
    pub(crate) test: bool,
    /// What cargo passes.
    #[arg(long, hide = true)]
    bench: bool,
    /// Only rows whose `scene/workload` has this in it.
    pub(crate) filter: Option<String>,
}

impl Options {
    /// The options, made small for a test.
    pub(crate) fn from_command_line() -> Self {
        let mut options = Self::parse();
        if options.test {
            options.size = (24, 16);
            options.turns = 1;
            options.kilotriangles = 2;
            options.threads.truncate(2);
        }
        options
    }

    pub(crate) fn wants_scene(&self, name: &str, is_mesh: bool) -> bool {
        let wanted = |scene: &String| {
            name.contains(scene.as_str()) || (is_mesh && ["bunny", "mesh"].contains(&&**scene))
        };
        self.scene.is_empty() || self.scene.iter().any(wanted)
    }

    pub(crate) fn wants_row(&self, scene: &str, workload: &str) -> bool {
        let row = format!("{scene}/{workload}");
        self.filter.as_ref().is_none_or(|filter| row.contains(filter.as_str()))
    }
}

/// A kind of rays, in its own order or shuffled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rays {
    pub(crate) kind: Kind,
    pub(crate) shuffled: bool,
}

impl std::str::FromStr for Rays {
    type Err = UnknownKind;

    fn from_str(name: &str) -> Result<Self, UnknownKind> {
        let kind = name.strip_suffix("-shuffled");
        Ok(Self { kind: kind.unwrap_or(name).parse()?, shuffled: kind.is_some() })
    }
}

fn parse_size(size: &str) -> Result<(usize, usize), String> {
    let (width, height) = size.split_once('x').unwrap_or((size, size));
    match (width.parse(), height.parse()) {
        (Ok(width), Ok(height)) if width > 0 && height > 0 => Ok((width, height)),
        _ => Err(format!("`{size}` is no size: give 512 or 640x480")),
    }
}

fn parse_threads(threads: &str) -> Result<usize, String> {
    match threads.parse() {
        _ if threads == "all" => Ok(0),
        Ok(number) if number > 0 => Ok(number),
        _ => Err(format!("`{threads}` is no number of threads: give 1 or more, or `all`")),
    }
}
