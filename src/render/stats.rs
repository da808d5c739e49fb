//! What a picture cost.

use serde::Serialize;

/// Rays by kind, and where the time went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RenderStats {
    /// Rays from the camera.
    pub primary_rays: u64,
    /// Rays from mirrors.
    pub mirror_rays: u64,
    /// Samples of lights that points look at, those among them that are settled without a ray. Lights
    /// that give a point nothing are not looked at and not counted.
    pub shadow_rays: u64,
    /// Those among them that had to be placed on the light: the samples of points that are not settled
    /// without a ray.
    pub placed_samples: u64,
    /// Seconds of each phase, summed over the threads.
    pub phases: PhaseSeconds,
    /// Seconds from the first tile to the finished picture.
    pub wall_seconds: f64,
    /// Threads that rendered.
    pub threads: usize,
}

/// Seconds of each phase, summed over the threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PhaseSeconds {
    /// Sample positions and camera rays.
    pub camera: f64,
    /// Closest hits of camera and mirror rays.
    pub intersect: f64,
    /// Surfaces, the Phong formula, and making mirror rays.
    pub shade: f64,
    /// Which fraction of each light points see, the samples' positions with it.
    pub shadow: f64,
    /// Sums of samples, written to the picture; most of it is the first use of the picture's memory.
    pub film: f64,
}

impl RenderStats {
    /// All rays.
    pub fn rays(&self) -> u64 {
        self.primary_rays + self.mirror_rays + self.shadow_rays
    }

    /// Million rays a second of wall time; 0 before any time has passed.
    pub fn mray_per_second(&self) -> f64 {
        if self.wall_seconds > 0.0 { self.rays() as f64 / self.wall_seconds * 1e-6 } else { 0.0 }
    }

    /// Adds the rays and the phases of `other`, not its wall time and threads.
    pub(super) fn add(&mut self, other: &Self) {
        self.primary_rays += other.primary_rays;
        self.mirror_rays += other.mirror_rays;
        self.shadow_rays += other.shadow_rays;
        self.placed_samples += other.placed_samples;
        self.phases.camera += other.phases.camera;
        self.phases.intersect += other.phases.intersect;
        self.phases.shade += other.phases.shade;
        self.phases.shadow += other.phases.shadow;
        self.phases.film += other.phases.film;
    }
}

/// Tells the time since it was last asked.
pub(super) struct Lap(std::time::Instant);

impl Lap {
    pub(super) fn start() -> Self {
        Self(std::time::Instant::now())
    }

    /// The seconds since the start or the last call.
    pub(super) fn seconds(&mut self) -> f64 {
        let now = std::time::Instant::now();
        let seconds = (now - self.0).as_secs_f64();
        self.0 = now;
        seconds
    }
}
