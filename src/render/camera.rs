//! Camera rays, sixteen at a time: through which points of which pixels, and where to.

use bumpalo::Bump;

use crate::render::arena::{ArenaRays, array};
use crate::render::frame::Frame;
use crate::render::tile::LARGEST_SIDE;
use crate::scene::{LANES, Vectors};
use crate::shading::sampling::{PixelSamples, SampleKey};
use crate::simd::{F32x16, each};

/// Column and row of a pixel in the full picture.
pub(super) type Place = [u32; 2];

/// The camera rays of a wave: all samples of the first pixel, then those of the second, and so on.
pub(super) struct Paths<'a> {
    pub(super) places: &'a [Place],
    /// The first column and row of the places' tile.
    pub(super) corner: Place,
    pub(super) spp: u32,
    pub(super) seed: u64,
    /// Which of the rays of all places the wave has.
    pub(super) first: usize,
    pub(super) last: usize,
}

impl Paths<'_> {
    pub(super) fn len(&self) -> usize {
        self.last - self.first
    }

    /// Names the samples of a path.
    #[inline(always)]
    pub(super) fn key(&self, path: u32) -> SampleKey {
        let ray = self.first + path as usize;
        let (place, sample) = self.split(ray);
        let [x, y] = self.places[place];
        SampleKey::new(x, y, sample, self.seed)
    }

    /// The pixel and the sample of a ray.
    #[inline(always)]
    fn split(&self, ray: usize) -> (usize, u32) {
        if self.spp == 1 {
            return (ray, 0);
        }
        // Both fit: a tile has 4,096 pixels of at most 65,536 samples.
        let (ray, spp) = (ray as u32, self.spp);
        ((ray / spp) as usize, ray % spp)
    }
}

/// The arrays that camera rays are made in.
pub(super) struct CameraRays<'b> {
    x: &'b mut [u32],
    y: &'b mut [u32],
    /// Where in the pixel, from 0 to 1; with one ray a pixel, which goes through its centre, where in the
    /// picture.
    across: &'b mut [f32],
    down: &'b mut [f32],
}

impl<'b> CameraRays<'b> {
    pub(super) fn with_capacity_in(frame: &Frame<'_>, capacity: usize, arena: &'b Bump) -> Self {
        let sampled = if frame.settings.spp == 1 { 0 } else { capacity };
        Self {
            x: array(sampled, 0, arena),
            y: array(sampled, 0, arena),
            across: array(capacity, 0.0, arena),
            down: array(capacity, 0.0, arena),
        }
    }

    /// Appends the rays of `paths` to `rays`.
    pub(super) fn push(&mut self, frame: &Frame<'_>, paths: &Paths<'_>, rays: &mut ArenaRays<'_>) {
        let [width, height] = [frame.settings.width, frame.settings.height];
        if paths.spp == 1 {
            self.place_centers(paths, [width, height]);
        } else {
            self.place_samples(paths);
        }
        let eye: Vectors = each(|axis| F32x16::splat(frame.view.eye[axis]));
        let one = F32x16::splat(1.0);
        let mut path = [0; LANES];
        for start in (0..paths.len()).step_by(LANES) {
            let lanes = (1_u32 << (paths.len() - start).min(LANES)) - 1;
            for (lane, path) in path.iter_mut().enumerate() {
                *path = (start + lane) as u32;
            }
            let at = [sixteen(self.across, start), sixteen(self.down, start)];
            let [across, down] = if paths.spp == 1 {
                at
            } else {
                let [x, y] = [sixteen(self.x, start), sixteen(self.y, start)];
                [shares(x, at[0], width), shares(y, at[1], height)]
            };
            let dir = frame.view.dirs(F32x16::new(across), F32x16::new(down));
            rays.push((&eye, &dir), (&path, one), lanes);
        }
    }

    /// Writes where in the picture each ray goes through, if it goes through the centre of its pixel.
    fn place_centers(&mut self, paths: &Paths<'_>, pixels: [u32; 2]) {
        // A tile has few columns and rows.
        let along: [[f32; LARGEST_SIDE as usize]; 2] =
            each(|axis| each(|step| share(paths.corner[axis] + step as u32, 0.5, pixels[axis])));
        for (ray, place) in paths.places[paths.first..paths.last].iter().enumerate() {
            let [x, y] = each(|axis| (place[axis] - paths.corner[axis]) % LARGEST_SIDE);
            (self.across[ray], self.down[ray]) = (along[0][x as usize], along[1][y as usize]);
        }
    }

    /// Writes the pixel of each ray, and where in it the ray goes through.
    fn place_samples(&mut self, paths: &Paths<'_>) {
        let mut ray = 0;
        while ray < paths.len() {
            let (place, sample) = paths.split(paths.first + ray);
            let [x, y] = paths.places[place];
            let end = paths.len().min(ray + (paths.spp - sample) as usize);
            self.x[ray..end].fill(x);
            self.y[ray..end].fill(y);
            let samples = PixelSamples::new(x, y, paths.spp, paths.seed);
            samples.fill(sample, &mut self.across[ray..end], &mut self.down[ray..end]);
            ray = end;
        }
    }
}

fn sixteen<T: Copy>(array: &[T], start: usize) -> [T; LANES] {
    array[start..start + LANES].try_into().expect("whole registers")
}

/// How far across the picture points of pixels are, from 0 to 1.
#[inline(always)]
fn shares(pixel: [u32; LANES], at: [f32; LANES], pixels: u32) -> [f32; LANES] {
    each(|lane| share(pixel[lane], at[lane], pixels))
}

#[inline(always)]
fn share(pixel: u32, at: f32, pixels: u32) -> f32 {
    // In doubles: a float has no bits left for the place in the pixel of a large picture.
    ((f64::from(pixel) + f64::from(at)) / f64::from(pixels)) as f32
}
