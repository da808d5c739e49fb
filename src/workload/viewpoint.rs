//! The rays of a workload, out of a scene, a camera and a light.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::random::Random;
use super::{Kind, Lamp, Stage, Workload};
use crate::hit::HitBatch;
use crate::ray::{Ray, RayBatch};
use crate::scene::{CameraError, LightShape, Scene};

/// The side of a tile of pixels.
pub const TILE: usize = 16;

/// The side of a block of pixels or of light samples.
const BLOCK: usize = 4;

/// Secondary rays start this many diagonals above the surface.
const OFFSET: f32 = 1e-4;

/// Ambient occlusion looks this many diagonals far.
const AO_DISTANCE: f32 = 0.5;

/// A picture's primary rays with their hits: what every workload starts from.
#[derive(Clone, Debug)]
pub struct Viewpoint<'a> {
    scene: &'a Scene,
    stage: Stage,
    seed: u64,
    rays: RayBatch,
    hits: HitBatch,
    /// The rays of each tile of pixels.
    tiles: Vec<Range<usize>>,
}

/// Points that look at lights, in SoA arrays.
#[derive(Clone, Debug)]
pub struct ShadowPoints {
    /// What they look at, one after the other.
    pub lights: Vec<LightShape>,
    /// Where shadow rays start: x, y and z.
    pub position: [Vec<f32>; 3],
    /// The unit normals of the surfaces, on the viewer's side.
    pub normal: [Vec<f32>; 3],
    /// The first coordinate of the samples on each light, all of a point together.
    pub u: Vec<f32>,
    /// The second one.
    pub v: Vec<f32>,
}

/// A primary hit, ready for rays to leave from.
struct Start {
    /// Above the surface, on the viewer's side.
    origin: Vec3,
    /// Of unit length, towards the viewer.
    normal: Vec3,
    /// The unit direction of the primary ray.
    incoming: Vec3,
    random: Random,
}

impl<'a> Viewpoint<'a> {
    /// Looks at the scene through `width` x `height` pixels. Finds the primary hits with the
    /// scene's own batch query, on the rayon pool that it is called in.
    ///
    /// # Errors
    /// [`CameraError`] if the stage's camera can't take a picture.
    pub fn new(
        scene: &'a Scene,
        stage: &Stage,
        width: usize,
        height: usize,
        seed: u64,
    ) -> Result<Self, CameraError> {
        Self::with_hits(scene, stage, width, height, seed, |rays| {
            let mut hits = HitBatch::new(rays.len());
            let query = scene.par_intersect_batch(rays.as_rays(), hits.as_hits());
            query.expect("there are as many hits as rays");
            hits
        })
    }

    /// As [`Viewpoint::new`], with the primary hits that `intersect` finds for the rays. Panics if
    /// it returns another number of hits, and later on if they name primitives that the scene does
    /// not have.
    ///
    /// # Errors
    /// [`CameraError`] if the stage's camera can't take a picture.
    pub fn with_hits(
        scene: &'a Scene,
        stage: &Stage,
        width: usize,
        height: usize,
        seed: u64,
        intersect: impl FnOnce(&RayBatch) -> HitBatch,
    ) -> Result<Self, CameraError> {
        let view = stage.camera.view(width as f32 / height as f32)?;
        let (pixels, tiles) = tile_order(width, height);
        let size = Vec2::new(width as f32, height as f32);
        let rays: RayBatch = pixels
            .iter()
            .map(|&(x, y)| {
                let mut random = Random::new(seed, (y * width + x) as u64);
                let jitter = Vec2::new(random.unit(), random.unit());
                let at = (Vec2::new(x as f32, y as f32) + jitter) / size;
                Ray::new(view.eye, view.dir(at).normalize())
            })
            .collect();
        let hits = intersect(&rays);
        assert_eq!(hits.len(), rays.len(), "one hit for each primary ray");
        Ok(Self { scene, stage: *stage, seed, rays, hits, tiles })
    }

    /// The workload of this kind. Primary rays that hit nothing have no secondary rays.
    pub fn workload(&self, kind: Kind) -> Workload {
        let rays = match kind {
            Kind::Primary => self.rays.clone(),
            Kind::Mirror => self.one_per_hit(kind, |start| {
                Ray::new(start.origin, reflect(start.incoming, start.normal))
            }),
            Kind::Diffuse => self.one_per_hit(kind, |start| {
                Ray::new(start.origin, start.random.cosine_hemisphere(start.normal))
            }),
            Kind::Ao => self.one_per_hit(kind, |start| Ray {
                t_max: AO_DISTANCE * self.stage.diagonal,
                ..Ray::new(start.origin, start.random.cosine_hemisphere(start.normal))
            }),
            Kind::Hard | Kind::Soft(_) | Kind::Lamp(..) => self.shadows(kind),
        };
        Workload { name: kind.to_string(), rays, query: kind.query() }
    }

    /// One ray from each primary hit, in the order of the primary rays.
    fn one_per_hit(&self, kind: Kind, ray: impl Fn(&mut Start) -> Ray) -> RayBatch {
        let starts = (0..self.rays.len()).filter_map(|index| self.start(kind, index));
        starts.map(|mut start| ray(&mut start)).collect()
    }

    fn shadows(&self, kind: Kind) -> RayBatch {
        let Some(set) = self.shadow_points(kind) else { return RayBatch::default() };
        let points = set.position[0].len();
        let mut rays = RayBatch::with_capacity(set.u.len() * set.lights.len());
        for light in &set.lights {
            for (index, (&u, &v)) in set.u.iter().zip(&set.v).enumerate() {
                let point = index * points / set.u.len();
                let origin = Vec3::from(set.position.each_ref().map(|part| part[point]));
                rays.push(&towards(origin, light.at(u, v)));
            }
        }
        rays
    }

    /// The points, lights and samples of rays that go to lights; `None` for other kinds. The rays of
    /// the workload go through the lights, then through the points, then through the samples.
    pub fn shadow_points(&self, kind: Kind) -> Option<ShadowPoints> {
        let (samples, lights) = match kind {
            Kind::Hard => (1, vec![LightShape::Point(self.stage.light.at(0.5, 0.5))]),
            Kind::Soft(samples) => (samples, vec![self.stage.light]),
            Kind::Lamp(lamp, samples) => (samples, self.lights(lamp)),
            _ => return None,
        };
        // As many tiles as give about one ray a pixel, spread at random and in picture order.
        let count = (self.tiles.len() / (samples as usize * lights.len().max(1))).max(1);
        let mut order = Random::new(self.seed, 0x007e_1e5e).permutation(self.tiles.len());
        order.truncate(count);
        order.sort_unstable();
        let strata = block_order(samples);
        let empty = || [const { Vec::new() }; 3];
        let (position, normal) = (empty(), empty());
        let mut points = ShadowPoints { lights, position, normal, u: Vec::new(), v: Vec::new() };
        for tile in order {
            for index in self.tiles[tile as usize].clone() {
                let Some(mut start) = self.start(kind, index) else { continue };
                for axis in 0..3 {
                    points.position[axis].push(start.origin[axis]);
                    points.normal[axis].push(start.normal[axis]);
                }
                for &(corner, size) in &strata {
                    let jitter = match kind {
                        Kind::Hard => Vec2::splat(0.5),
                        _ => Vec2::new(start.random.unit(), start.random.unit()),
                    };
                    let at = corner + jitter * size;
                    points.u.push(at.x);
                    points.v.push(at.y);
                }
            }
        }
        Some(points)
    }

    /// The lights of a lamp, of which some hang on the surface in the middle of the picture.
    fn lights(&self, lamp: Lamp) -> Vec<LightShape> {
        let dir = |index: usize| self.rays.as_rays().get(index).dir;
        let middle: Vec3 = (0..self.rays.len()).map(dir).sum();
        let starts = (0..self.rays.len()).filter(|&index| self.hits.get(index).is_hit());
        let central = starts.max_by(|&a, &b| middle.dot(dir(a)).total_cmp(&middle.dot(dir(b))));
        let start = central.and_then(|index| self.start(Kind::Primary, index));
        start.map_or_else(Vec::new, |start| lamp.lights(&self.stage, start.origin, start.normal))
    }

    fn start(&self, kind: Kind, index: usize) -> Option<Start> {
        let (ray, hit) = (self.rays.as_rays().get(index), self.hits.get(index));
        if !hit.is_hit() {
            return None;
        }
        let surface = self.scene.surface(&ray, &hit);
        let normal = surface.geometric_normal;
        let normal = if normal.dot(ray.dir) > 0.0 { -normal } else { normal };
        let stream = match kind {
            Kind::Primary => 0,
            Kind::Mirror => 1,
            Kind::Diffuse => 2,
            Kind::Hard => 3,
            Kind::Ao => 4,
            Kind::Soft(samples) => 5 + u64::from(samples),
            // No other kind has so many samples.
            Kind::Lamp(lamp, samples) => ((lamp as u64 + 1) << 16) + u64::from(samples),
        };
        Some(Start {
            origin: surface.position + normal * (OFFSET * self.stage.diagonal),
            normal,
            incoming: ray.dir,
            random: Random::new(self.seed.wrapping_add(stream << 32), index as u64),
        })
    }
}

/// The ray from `origin` that ends at `target`, with `t` from 0 to 1.
fn towards(origin: Vec3, target: Vec3) -> Ray {
    Ray { t_max: 1.0, ..Ray::new(origin, target - origin) }
}

fn reflect(incoming: Vec3, normal: Vec3) -> Vec3 {
    incoming - normal * (2.0 * incoming.dot(normal))
}

/// The pixels in tiles of blocks, and which of them each tile has.
fn tile_order(width: usize, height: usize) -> (Vec<(usize, usize)>, Vec<Range<usize>>) {
    let mut pixels = Vec::with_capacity(width * height);
    let mut tiles = Vec::new();
    for (left, top) in grid(0..width, 0..height, TILE) {
        let first = pixels.len();
        let (right, bottom) = ((left + TILE).min(width), (top + TILE).min(height));
        for (x, y) in grid(left..right, top..bottom, BLOCK) {
            pixels.extend(grid(x..(x + BLOCK).min(right), y..(y + BLOCK).min(bottom), 1));
        }
        tiles.push(first..pixels.len());
    }
    (pixels, tiles)
}

/// The strata of the unit square for so many samples, as corner and size, in 4 x 4 blocks. If the
/// number is not a square, the first strata of the next larger one.
fn block_order(samples: u32) -> Vec<(Vec2, f32)> {
    let side = (1..).find(|side| side * side >= samples).unwrap_or(1) as usize;
    let size = 1.0 / side as f32;
    let blocks = grid(0..side, 0..side, BLOCK);
    let strata =
        blocks.flat_map(|(x, y)| grid(x..(x + BLOCK).min(side), y..(y + BLOCK).min(side), 1));
    let corner = |(x, y): (usize, usize)| (Vec2::new(x as f32, y as f32) * size, size);
    strata.map(corner).take(samples as usize).collect()
}

/// Every `step`-th point of a rectangle, row by row.
fn grid(x: Range<usize>, y: Range<usize>, step: usize) -> impl Iterator<Item = (usize, usize)> {
    y.step_by(step).flat_map(move |y| x.clone().step_by(step).map(move |x| (x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_hold_every_pixel_once() {
        let (mut pixels, tiles) = tile_order(37, 21);
        assert_eq!(tiles.len(), 6);
        assert_eq!(tiles[0], 0..256);
        assert_eq!(&pixels[..5], [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1)]);
        assert_eq!(pixels[16], (4, 0));
        pixels.sort_unstable();
        pixels.dedup();
        assert_eq!(pixels.len(), 37 * 21);
    }

    #[test]
    fn light_samples_come_in_blocks() {
        let strata = block_order(64);
        assert_eq!(strata.len(), 64);
        assert!(strata[..16].iter().all(|(corner, _)| corner.max_element() < 0.5));
        assert!(strata[16..32].iter().all(|(corner, _)| corner.x >= 0.5 && corner.y < 0.5));
        assert_eq!(block_order(5).len(), 5);
    }
}
