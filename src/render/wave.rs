//! A wave: up to 1,024 camera rays and all that follows from them, round by round.
//!
//! A round intersects its rays as one batch, turns the hits into [`ShadingPoint`]s, lights those
//! (`shadows`), and packs the rays of mirrors together as the next round. `path` numbers the camera
//! rays; each ray carries the path that it belongs to and its weight in the path's colour.
//!
//! The colour of a path is summed in an order of its own (ambient light, then light by light, then
//! the next bounce), so it does not depend on which other paths are in the wave.

use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::Vec3;

use crate::ray::Ray;
use crate::render::arena::{ArenaHits, ArenaRays};
use crate::render::frame::{Cancelled, Frame};
use crate::render::shadows::ShadowBatch;
use crate::render::stats::{Lap, RenderStats};
use crate::scene::Surface;
use crate::shading::phong;
use crate::shading::sampling::SampleKey;

/// The most camera rays in a wave: four traversal tiles, so that all arrays stay in the cache.
pub(super) const WAVE_RAYS: usize = 1024;

/// Where light is looked up.
#[derive(Clone, Copy)]
pub(super) struct ShadingPoint {
    /// The camera ray that it belongs to.
    pub(super) path: u32,
    /// The number of its material.
    pub(super) material: u32,
    /// What its own colour counts for in the path's.
    pub(super) weight: f32,
    pub(super) position: Vec3,
    /// Where its shadow rays start: off the surface, on the viewer's side.
    pub(super) origin: Vec3,
    /// The unit normals on the viewer's side.
    pub(super) normal: Vec3,
    pub(super) geometric_normal: Vec3,
    /// The unit direction back along the ray.
    pub(super) to_viewer: Vec3,
}

/// The paths, each started by a camera ray.
pub(super) struct Paths<'b> {
    /// Names its samples.
    pub(super) key: ArenaVec<'b, SampleKey>,
    /// What it has gathered.
    pub(super) color: ArenaVec<'b, Vec3>,
}

/// The rays of one round.
struct Round<'b> {
    rays: ArenaRays<'b>,
    path: ArenaVec<'b, u32>,
    weight: ArenaVec<'b, f32>,
}

impl<'b> Round<'b> {
    fn with_capacity_in(capacity: usize, arena: &'b Bump) -> Self {
        Self {
            rays: ArenaRays::with_capacity_in(capacity, arena),
            path: ArenaVec::with_capacity_in(capacity, arena),
            weight: ArenaVec::with_capacity_in(capacity, arena),
        }
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.path.clear();
        self.weight.clear();
    }

    fn push(&mut self, ray: &Ray, path: u32, weight: f32) {
        self.rays.push(ray);
        self.path.push(path);
        self.weight.push(weight);
    }
}

/// The arrays of a wave, used again by each wave of a tile.
pub(super) struct Wave<'b> {
    paths: Paths<'b>,
    round: Round<'b>,
    next_round: Round<'b>,
    hits: ArenaHits<'b>,
    points: ArenaVec<'b, ShadingPoint>,
    shadows: ShadowBatch<'b>,
}

impl<'b> Wave<'b> {
    pub(super) fn with_capacity_in(frame: &Frame<'_>, capacity: usize, arena: &'b Bump) -> Self {
        let lit = if frame.is_unlit() { 0 } else { capacity };
        let has_mirrors = frame.scene.materials().iter().any(|material| material.mirror > 0.0);
        let mirrored = if has_mirrors { lit } else { 0 };
        Self {
            paths: Paths {
                key: ArenaVec::with_capacity_in(capacity, arena),
                color: ArenaVec::with_capacity_in(capacity, arena),
            },
            round: Round::with_capacity_in(capacity, arena),
            next_round: Round::with_capacity_in(mirrored, arena),
            hits: ArenaHits::with_capacity_in(capacity, arena),
            points: ArenaVec::with_capacity_in(lit, arena),
            shadows: ShadowBatch::new_in(frame, lit, arena),
        }
    }

    pub(super) fn clear(&mut self) {
        self.paths.key.clear();
        self.paths.color.clear();
        self.round.clear();
    }

    /// Adds a path.
    pub(super) fn push(&mut self, ray: &Ray, key: SampleKey) {
        self.round.push(ray, self.paths.color.len() as u32, 1.0);
        self.paths.key.push(key);
        self.paths.color.push(Vec3::ZERO);
    }

    /// The colours of the paths, in the order in which they were added.
    pub(super) fn colors(&self) -> &[Vec3] {
        &self.paths.color
    }

    /// Follows all paths, of which there is at least one, to their ends.
    pub(super) fn trace(
        &mut self,
        frame: &Frame<'_>,
        stats: &mut RenderStats,
    ) -> Result<(), Cancelled> {
        let mut bounce = 0;
        loop {
            frame.check_cancelled()?;
            let rays = self.round.rays.len() as u64;
            *(if bounce == 0 { &mut stats.primary_rays } else { &mut stats.mirror_rays }) += rays;
            let mut lap = Lap::start();
            self.hits.resize(self.round.rays.len());
            let met = frame.scene.intersect_batch(self.round.rays.as_rays(), self.hits.as_hits());
            debug_assert!(met.is_ok(), "there are as many hits as rays");
            stats.phases.intersect += lap.seconds();

            self.next_round.clear();
            if frame.is_unlit() {
                self.settle_unlit(frame);
                stats.phases.shade += lap.seconds();
            } else {
                self.find_points(frame, bounce);
                stats.phases.shade += lap.seconds();
                for light in 0..frame.scene.lights().len() {
                    self.shadows.light(
                        frame,
                        (bounce, light),
                        &self.points,
                        &mut self.paths,
                        stats,
                    )?;
                }
            }
            if self.next_round.rays.len() == 0 {
                return Ok(());
            }
            std::mem::swap(&mut self.round, &mut self.next_round);
            bounce += 1;
        }
    }

    fn settle_unlit(&mut self, frame: &Frame<'_>) {
        let rays = self.round.rays.as_rays();
        for (index, color) in self.paths.color.iter_mut().enumerate() {
            let (ray, hit) = (rays.get(index), self.hits.get(index));
            let surface = hit.is_hit().then(|| frame.scene.surface(&ray, &hit));
            *color = frame.unlit(&ray, &hit, surface.as_ref());
        }
    }

    /// Turns hits into shading points with their ambient light, and into mirror rays.
    fn find_points(&mut self, frame: &Frame<'_>, bounce: u32) {
        self.points.clear();
        let rays = self.round.rays.as_rays();
        for index in 0..rays.len() {
            let (path, weight) = (self.round.path[index], self.round.weight[index]);
            let color = &mut self.paths.color[path as usize];
            let hit = self.hits.get(index);
            if !hit.is_hit() {
                *color += frame.settings.background * weight;
                continue;
            }
            let ray = rays.get(index);
            let mut surface = frame.scene.surface(&ray, &hit);
            turn_to_viewer(&mut surface, ray.dir);
            let material = &frame.scene.materials()[surface.material as usize];
            let to_viewer = -ray.dir.normalize();
            let own = weight * (1.0 - material.mirror);
            if own > 0.0 {
                *color += frame.ambient * material.ambient * own;
                self.points.push(ShadingPoint {
                    path,
                    material: surface.material,
                    weight: own,
                    position: surface.position,
                    origin: surface.offset_origin(surface.geometric_normal),
                    normal: surface.shading_normal,
                    geometric_normal: surface.geometric_normal,
                    to_viewer,
                });
            }
            if material.mirror > 0.0 && bounce < frame.settings.max_bounces {
                let ray = mirror_ray(&surface, to_viewer);
                self.next_round.push(&ray, path, weight * material.mirror);
            }
        }
    }
}

/// Puts both normals on the side that a ray along `dir` comes from: surfaces have two sides.
fn turn_to_viewer(surface: &mut Surface, dir: Vec3) {
    if surface.geometric_normal.dot(dir) > 0.0 {
        surface.geometric_normal = -surface.geometric_normal;
        surface.shading_normal = -surface.shading_normal;
    }
}

/// The ray that a mirror sends on, of unit length. An interpolated normal can point it through the
/// surface; then the surface's own normal mirrors it.
fn mirror_ray(surface: &Surface, to_viewer: Vec3) -> Ray {
    let mut dir = phong::mirrored(to_viewer, surface.shading_normal);
    if dir.dot(surface.geometric_normal) <= 0.0 {
        dir = phong::mirrored(to_viewer, surface.geometric_normal);
    }
    Ray::new(surface.offset_origin(surface.geometric_normal), dir)
}
