//! Loading a scene, with a bar for long builds and an ear for Ctrl-C.

use std::io::{self, IsTerminal};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use octray::BuildError;
use octray::bvh::{BuildProgress, Watch};
use octray::scene::{LoadOptions, Loaded, Problem, load_with};

use super::Stop;
use super::args::BuildArg;

/// What is shown of the build, and what ends it.
#[derive(Clone, Copy, Default)]
pub(super) struct Loading<'a> {
    shown: bool,
    cancel: Option<&'a AtomicBool>,
}

impl<'a> Loading<'a> {
    /// With a bar.
    pub(super) fn shown() -> Self {
        Self { shown: true, cancel: None }
    }

    /// The same, ended by this.
    pub(super) fn cancelled_by(self, cancel: &'a AtomicBool) -> Self {
        Self { cancel: Some(cancel), ..self }
    }
}

/// Loads a scene.
pub(super) fn load(
    path: &Path,
    build: Option<BuildArg>,
    loading: &Loading<'_>,
) -> Result<Loaded, Stop> {
    let bar = bar(loading.shown);
    let tell = |progress: &BuildProgress| {
        bar.set_length(progress.steps as u64);
        bar.set_message("building the tree");
        // Threads tell in any order.
        bar.set_position(bar.position().max(progress.done as u64));
    };
    let mut watch = Watch::new();
    if !bar.is_hidden() {
        watch = watch.on_progress(&tell);
    }
    if let Some(cancel) = loading.cancel {
        watch = watch.cancel(cancel);
    }
    let options = LoadOptions { build: build.map(Into::into), watch: Some(&watch) };
    let loaded = load_with(path, options);
    bar.finish_and_clear();
    loaded.map_err(|error| match error.problem {
        Problem::Build(BuildError::Cancelled) => Stop::Interrupted,
        _ => Stop::failed(error),
    })
}

/// A bar on a terminal; hidden in a pipe.
pub(super) fn bar(shown: bool) -> ProgressBar {
    if !shown || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {percent:>3}%  {msg}  {eta} left");
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
