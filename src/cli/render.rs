//! `octray render`: a scene file becomes a picture file.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use indicatif::ProgressBar;
use octray::render::{PictureFile, Progress, RenderError, RenderStats, Renderer};
use octray::scene::Loaded;

use super::args::RenderArgs;
use super::load::{Loading, bar, load};
use super::{Stop, answer, say};

pub(super) fn run(args: &RenderArgs) -> Result<(), Stop> {
    let output = args.output.clone().unwrap_or_else(|| default_output(&args.scene));
    let file = PictureFile::new(&output).map_err(Stop::failed)?;
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).map_err(Stop::failed)?;
    if args.threads > 0 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global();
        pool.map_err(|why| Stop::Failed(format!("{} threads: {why}", args.threads)))?;
    }

    let start = Instant::now();
    let loading = if args.quiet { Loading::default() } else { Loading::shown() };
    let loaded = load(&args.scene, args.build, &loading.cancelled_by(&interrupted))?;
    if !args.quiet {
        loaded.warnings.iter().for_each(|warning| say(&format!("warning: {warning}")));
    }
    let load_seconds = start.elapsed().as_secs_f64();
    let Loaded { scene, camera, mut settings, .. } = loaded;
    if let Some((width, height)) = args.size {
        (settings.width, settings.height) = (width, height);
    }
    settings.spp = args.spp.unwrap_or(settings.spp);
    settings.shadow_samples = args.shadow_samples.unwrap_or(settings.shadow_samples);
    settings.max_bounces = args.max_bounces.unwrap_or(settings.max_bounces);
    settings.seed = args.seed.unwrap_or(settings.seed);

    let shown = args.crop.map_or((settings.width, settings.height), |c| (c.width(), c.height()));
    file.check_size(shown.0, shown.1).map_err(Stop::failed)?;
    let bar = bar(!args.quiet);
    let on_progress = |progress: &Progress| show(&bar, progress);
    let mut renderer = Renderer::new(&scene, &camera, settings)
        .aov(args.aov.into())
        .on_progress(&on_progress)
        .cancel(&interrupted);
    if let Some(crop) = args.crop {
        renderer = renderer.crop(crop);
    }
    let picture = renderer.render_to(&file);
    bar.finish_and_clear();
    let picture = match picture {
        Err(RenderError::Cancelled) => return Err(Stop::Interrupted),
        picture => picture.map_err(Stop::failed)?,
    };
    if interrupted.load(Ordering::Relaxed) {
        return Err(Stop::Interrupted);
    }

    let save_start = Instant::now();
    picture.save().map_err(Stop::failed)?;
    let save_seconds = save_start.elapsed().as_secs_f64();
    let stats = picture.stats();
    if !args.quiet {
        say(&summary(&output, shown, stats));
    }
    if args.json {
        let json = serde_json::json!({
            "scene": args.scene,
            "output": output,
            "width": shown.0,
            "height": shown.1,
            "threads": stats.threads,
            "rays": {
                "primary": stats.primary_rays,
                "mirror": stats.mirror_rays,
                "shadow": stats.shadow_rays,
                "total": stats.rays(),
            },
            "seconds": {
                "load": load_seconds,
                "render": stats.wall_seconds,
                "save": save_seconds,
                "phases": stats.phases,
            },
            "mray_per_second": stats.mray_per_second(),
        });
        answer(&format!("{json:#}\n"))?;
    }
    Ok(())
}

/// The scene's name with `.png`, in the current directory.
fn default_output(scene: &Path) -> PathBuf {
    let stem = scene.file_stem().unwrap_or(scene.as_os_str());
    let mut name = stem.to_owned();
    name.push(".png");
    PathBuf::from(name)
}

fn show(bar: &ProgressBar, progress: &Progress) {
    if bar.is_hidden() {
        return;
    }
    bar.set_length(u64::from(progress.tiles));
    bar.set_position(u64::from(progress.tiles_done));
    bar.set_message(format!("{:.1} Mray/s", progress.rays as f64 / progress.seconds * 1e-6));
}

fn summary(output: &Path, (width, height): (u32, u32), stats: &RenderStats) -> String {
    let threads = if stats.threads == 1 { "thread" } else { "threads" };
    format!(
        "{}: {width}x{height} in {:.2} s, {:.1} Mray/s on {} {threads} \
         ({} primary, {} mirror, {} shadow rays)",
        output.display(),
        stats.wall_seconds,
        stats.mray_per_second(),
        stats.threads,
        stats.primary_rays,
        stats.mirror_rays,
        stats.shadow_rays,
    )
}
