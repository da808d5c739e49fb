//! A wave: up to 4,096 camera rays and all that follows from them, round by round.
//!
//! A round intersects its rays as one batch, turns sixteen hits at a time into points (`shade`), lights
//! those (`shadows`), and packs the rays of mirrors together as the next round. A path is a camera ray
//! and what follows from it; each ray carries the number of its path and its weight in the path's colour.
//!
//! The colour of a path is summed in an order of its own (ambient light, then light by light, then
//! the next bounce), so it does not depend on which other paths are in the wave.

use bumpalo::Bump;

use crate::render::arena::{ArenaHits, ArenaRays};
use crate::render::camera::{CameraRays, Paths};
use crate::render::colors::Colors;
use crate::render::frame::{Cancelled, Frame};
use crate::render::shade::{ShadingPoints, shade};
use crate::render::shadows::ShadowBatch;
use crate::render::stats::{Lap, RenderStats};
use crate::scene::{LANES, SharedPrimitive};

/// The most camera rays in a wave: sixteen traversal tiles, so that all arrays stay in the second cache.
pub(super) const WAVE_RAYS: usize = 4096;

/// The arrays of a wave, used again by each wave of a worker.
pub(super) struct Wave<'b> {
    camera: CameraRays<'b>,
    /// The rays of mirrors.
    round: ArenaRays<'b>,
    next_round: ArenaRays<'b>,
    hits: ArenaHits<'b>,
    points: &'b mut [ShadingPoints],
    shadows: ShadowBatch<'b>,
    colors: Colors<'b>,
    last: SharedPrimitive,
}

impl<'b> Wave<'b> {
    pub(super) fn with_capacity_in(frame: &Frame<'_>, capacity: usize, arena: &'b Bump) -> Self {
        let lit = if frame.is_unlit() { 0 } else { capacity };
        let kept = if frame.scene.lights().len() > 1 { lit.div_ceil(LANES) } else { 1 };
        let has_mirrors = frame.scene.materials().iter().any(|material| material.mirror > 0.0);
        let mirrored = if has_mirrors { capacity } else { 0 };
        Self {
            camera: CameraRays::with_capacity_in(frame, capacity, arena),
            round: ArenaRays::with_capacity_in(mirrored, arena),
            next_round: ArenaRays::with_capacity_in(mirrored, arena),
            hits: ArenaHits::with_capacity_in(capacity, arena),
            points: arena.alloc_slice_fill_copy(kept, ShadingPoints::none()),
            shadows: ShadowBatch::new_in(frame, lit, arena),
            colors: Colors::with_capacity_in(capacity, arena),
            last: SharedPrimitive::default(),
        }
    }

    /// Follows all paths, of which there is at least one, to their ends. Returns their colours.
    pub(super) fn trace(
        &mut self,
        frame: &Frame<'_>,
        paths: &Paths<'_>,
        stats: &mut RenderStats,
    ) -> Result<&Colors<'b>, Cancelled> {
        let mut lap = Lap::start();
        self.camera.make(frame, paths);
        self.colors.clear(paths.len());
        stats.phases.camera += lap.seconds();
        let mut bounce = 0;
        loop {
            frame.check_cancelled()?;
            let round = if bounce == 0 { self.camera.rays() } else { &self.round };
            let rays = round.len();
            *(if bounce == 0 { &mut stats.primary_rays } else { &mut stats.mirror_rays }) +=
                rays as u64;
            lap.seconds();
            let met = frame.scene.intersect_batch(round.as_rays(), self.hits.as_hits(rays));
            debug_assert!(met.is_ok(), "there are as many hits as rays");
            stats.phases.intersect += lap.seconds();

            self.next_round.clear();
            if frame.is_unlit() {
                self.settle_unlit(frame);
                stats.phases.shade += lap.seconds();
            } else {
                let found = self.find_points(frame, bounce);
                stats.phases.shade += lap.seconds();
                for light in 0..frame.scene.lights().len() {
                    let mut lap = Lap::start();
                    if light > 0 {
                        self.shadows.clear();
                        let points = &self.points[..found];
                        points.iter().for_each(|points| self.shadows.push(frame, light, points));
                    }
                    stats.phases.shade += lap.seconds();
                    self.shadows.light(frame, (bounce, light), (paths, &mut self.colors), stats)?;
                }
            }
            if self.next_round.len() == 0 {
                return Ok(&self.colors);
            }
            std::mem::swap(&mut self.round, &mut self.next_round);
            bounce += 1;
        }
    }

    fn settle_unlit(&mut self, frame: &Frame<'_>) {
        let rays = self.camera.rays().as_rays();
        for index in 0..rays.len() {
            let (ray, hit) = (rays.get(index), self.hits.get(index));
            let surface = hit.is_hit().then(|| frame.scene.surface(&ray, &hit));
            self.colors.set(index, frame.unlit(&ray, &hit, surface.as_ref()));
        }
    }

    /// Has the points look at the first light while they are at hand. Fills `points` if there are more
    /// lights; how many of them there are.
    fn find_points(&mut self, frame: &Frame<'_>, bounce: u32) -> usize {
        let Self { camera, round, next_round, hits, points, shadows, colors, last } = self;
        let round = if bounce == 0 { camera.rays() } else { &*round };
        let lights = frame.scene.lights().len();
        let mut found = 0;
        shadows.clear();
        for start in (0..round.len()).step_by(LANES) {
            let mirrors = (bounce < frame.settings.max_bounces).then_some(&mut *next_round);
            let to = (&mut *colors, &mut points[found]);
            if shade(frame, (round, hits, start), last, mirrors, to) && lights > 0 {
                shadows.push(frame, 0, &points[found]);
                found += usize::from(lights > 1);
            }
        }
        found
    }
}
