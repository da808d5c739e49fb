//! The arguments.

use std::path::PathBuf;

use clap::builder::RangedI64ValueParser;
use clap::{Args, Parser, Subcommand, ValueEnum};
use octray::BuildQuality;
use octray::render::{Aov, Crop};
use octray::scene::{MAX_BOUNCES, MAX_SAMPLES};

const EXIT_CODES: &str = "\
Exit codes: 0 done, 1 failed (one message on stderr says why), 2 wrong usage, 130 interrupted.";

const RENDER_EXAMPLES: &str = "\
Examples:
  octray render scenes/cornell-box.toml
  octray render bunny.obj -o bunny.exr --size 1920x1080 --spp 16
  octray render scenes/mesh.toml -o normals.png --aov normal";

/// Ray tracing with SIMD packets: a scene file becomes a picture
#[derive(Parser)]
#[command(name = "octray", version, arg_required_else_help = true, after_help = EXIT_CODES)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Subcommand)]
pub(super) enum Command {
    /// Render a scene to a picture
    ///
    /// The format follows the extension of the picture: .png .jpg .bmp .tga .tiff .webp (8 bits,
    /// sRGB), .exr .hdr (linear floats). Options override the scene's own [render] table; without
    /// either there are defaults. A picture is the same for every number of threads.
    #[command(after_help = RENDER_EXAMPLES)]
    Render(RenderArgs),
    /// Show what a scene holds and how its tree came out
    Info(InfoArgs),
    /// Measure how many rays a second the queries make on a scene
    Bench(super::bench::BenchArgs),
}

#[derive(Args)]
pub(super) struct RenderArgs {
    /// The scene: a .toml file, or an .obj or .ply file alone
    pub(super) scene: PathBuf,
    /// The picture [default: the scene's name with .png, in the current directory]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Pixels across and down, such as 800x600
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(super) size: Option<(u32, u32)>,
    /// Camera rays a pixel
    #[arg(long, value_name = "N", value_parser = whole(1, MAX_SAMPLES))]
    pub(super) spp: Option<u32>,
    /// Shadow rays from each point to each area light
    #[arg(long, value_name = "N", value_parser = whole(1, MAX_SAMPLES))]
    pub(super) shadow_samples: Option<u32>,
    /// How often a ray is mirrored at most
    #[arg(long, value_name = "N", value_parser = whole(0, MAX_BOUNCES))]
    pub(super) max_bounces: Option<u32>,
    /// Threads; 0 for one a logical core
    #[arg(long, value_name = "N", default_value_t = 0,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(0..=1024))]
    pub(super) threads: usize,
    /// How much work goes into the tree [default: what the scene says, else balanced]
    #[arg(long, value_name = "QUALITY", value_enum)]
    pub(super) build: Option<BuildArg>,
    /// Another seed gives other noise
    #[arg(long, value_name = "N")]
    pub(super) seed: Option<u64>,
    /// Only this part, in pixels from the upper left; X1 and Y1 are not in it
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = crop)]
    pub(super) crop: Option<Crop>,
    /// What the picture shows
    #[arg(long, value_enum, default_value_t = AovArg::Color)]
    pub(super) aov: AovArg,
    /// No progress, no warnings, no summary; errors are still told
    #[arg(short, long)]
    pub(super) quiet: bool,
    /// Rays and seconds as JSON on stdout
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Args)]
pub(super) struct InfoArgs {
    /// The scene: a .toml file, or an .obj or .ply file alone
    pub(super) scene: PathBuf,
    /// How much work goes into the tree [default: what the scene says, else balanced]
    #[arg(long, value_name = "QUALITY", value_enum)]
    pub(super) build: Option<BuildArg>,
    /// JSON in place of the text
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum AovArg {
    /// Shaded colour
    Color,
    /// Shading normals: 0 to 1 for -1 to 1, as they are in .exr
    Normal,
    /// Distance from the camera: near is white, in scene units in .exr and .hdr
    Depth,
    /// Primitives: a colour each, geom_id and prim_id in .exr
    Prim,
}

impl From<AovArg> for Aov {
    fn from(aov: AovArg) -> Self {
        match aov {
            AovArg::Color => Self::Color,
            AovArg::Normal => Self::Normal,
            AovArg::Depth => Self::Depth,
            AovArg::Prim => Self::Prim,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum BuildArg {
    /// Built soonest
    Fast,
    /// Good rays for a short build
    Balanced,
    /// The fastest rays
    High,
}

impl From<BuildArg> for BuildQuality {
    fn from(build: BuildArg) -> Self {
        match build {
            BuildArg::Fast => Self::Fast,
            BuildArg::Balanced => Self::Balanced,
            BuildArg::High => Self::High,
        }
    }
}

fn whole(least: u32, most: u32) -> RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(i64::from(least)..=i64::from(most))
}

pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X']);
    match sides.map(|(width, height)| (width.parse(), height.parse())) {
        Some((Ok(width), Ok(height))) if width > 0 && height > 0 => Ok((width, height)),
        _ => Err("want two whole numbers above 0, such as 800x600".into()),
    }
}

fn crop(text: &str) -> Result<Crop, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Crop { x0, y0, x1, y1 }),
        _ => {
            Err("want four whole numbers with X0 < X1 and Y0 < Y1, such as 100,100,300,200".into())
        }
    }
}
