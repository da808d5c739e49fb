//! Watching a build: how far it is, and whether to go on.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use thiserror::Error;

/// How far a build is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildProgress {
    /// The steps done so far; each primitive takes two, and more with `high`.
    pub done: usize,
    /// The steps of the whole build.
    pub steps: usize,
}

/// Who watches a build: is told how far it is, and can end it.
///
/// ```
/// use std::sync::atomic::AtomicBool;
/// use octray::bvh::Watch;
///
/// let cancel = AtomicBool::new(false);
/// let tell = |progress: &octray::bvh::BuildProgress| {
///     assert!(progress.done <= progress.steps);
/// };
/// let watch = Watch::new().on_progress(&tell).cancel(&cancel);
/// let scene = octray::SceneBuilder::new().build_watched(&watch)?;
/// # Ok::<(), octray::BuildError>(())
/// ```
#[derive(Default)]
pub struct Watch<'a> {
    on_progress: Option<&'a (dyn Fn(&BuildProgress) + Sync)>,
    cancel: Option<&'a AtomicBool>,
    done: AtomicUsize,
    steps: AtomicUsize,
    /// That the build was found cancelled once: what is missing then stays missing.
    stopped: AtomicBool,
}

/// The build was cancelled.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("the build was cancelled")]
pub struct Cancelled;

impl<'a> Watch<'a> {
    /// Nobody.
    pub fn new() -> Self {
        Self::default()
    }

    /// Calls this every few thousand primitives, from the threads that build. Calls may come at
    /// once and out of order.
    pub fn on_progress(self, tell: &'a (dyn Fn(&BuildProgress) + Sync)) -> Self {
        Self { on_progress: Some(tell), ..self }
    }

    /// Ends the build soon after this becomes true.
    pub fn cancel(self, cancel: &'a AtomicBool) -> Self {
        Self { cancel: Some(cancel), ..self }
    }

    /// A build of so many steps begins.
    pub(super) fn start(&self, steps: usize) {
        self.done.store(0, Ordering::Relaxed);
        self.steps.store(steps, Ordering::Relaxed);
        self.stopped.store(false, Ordering::Relaxed);
    }

    /// So many steps are done.
    pub(super) fn add(&self, steps: usize) {
        let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
        if let Some(tell) = self.on_progress {
            tell(&BuildProgress { done, steps: self.steps.load(Ordering::Relaxed) });
        }
    }

    pub(super) fn is_cancelled(&self) -> bool {
        let cancelled = self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed));
        if cancelled {
            self.stopped.store(true, Ordering::Relaxed);
        }
        cancelled || self.stopped.load(Ordering::Relaxed)
    }

    pub(super) fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}
