//! Camera rays, sixteen at a time: through which points of which pixels, and where to.

use bumpalo::Bump;

use crate::render::arena::{ArenaRays, array};
use crate::render::frame::Frame;
use crate::render::tile::{CURVE, LARGEST_SIDE};
use crate::scene::LANES;
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

/// Where in the picture the centres of a tile's columns are, and of its rows.
type Centers = [[f32; LARGEST_SIDE as usize]; 2];

/// The camera rays of a wave, and the arrays that they are made in.
pub(super) struct CameraRays<'b> {
    /// All start at the eye, each has its path: only directions change.
    rays: ArenaRays<'b>,
    x: &'b mut [u32],
    y: &'b mut [u32],
    /// Where in the pixel, from 0 to 1, if it has several samples.
    across: &'b mut [f32],
    down: &'b mut [f32],
}

impl<'b> CameraRays<'b> {
    pub(super) fn with_capacity_in(frame: &Frame<'_>, capacity: usize, arena: &'b Bump) -> Self {
        let sampled = if frame.settings.spp == 1 { 0 } else { capacity };
        Self {
            rays: ArenaRays::from_eye(frame.view.eye, capacity, arena),
            x: array(sampled, 0, arena),
            y: array(sampled, 0, arena),
            across: array(sampled, 0.0, arena),
            down: array(sampled, 0.0, arena),
        }
    }

    /// Makes the rays of `paths`.
    pub(super) fn make(&mut self, frame: &Frame<'_>, paths: &Paths<'_>) {
        self.rays.set_len(paths.len());
        if paths.spp == 1 {
            self.through_centers(frame, paths);
        } else {
            self.through_samples(frame, paths);
        }
    }

    /// The rays that were made last.
    pub(super) fn rays(&self) -> &ArenaRays<'b> {
        &self.rays
    }

    fn through_centers(&mut self, frame: &Frame<'_>, paths: &Paths<'_>) {
        let pixels = [frame.settings.width, frame.settings.height];
        // A tile has few columns and rows.
        let centers: Centers =
            each(|axis| each(|step| share(paths.corner[axis] + step as u32, 0.5, pixels[axis])));
        let places = paths.places[paths.first..paths.last].chunks(LANES);
        for (start, places) in (0..).step_by(LANES).zip(places) {
            let [across, down] = sixteen_centers(&centers, places, paths.corner);
            self.rays.set_dirs(start, &frame.view.dirs(F32x16::new(across), F32x16::new(down)));
        }
    }

    fn through_samples(&mut self, frame: &Frame<'_>, paths: &Paths<'_>) {
        let [width, height] = [frame.settings.width, frame.settings.height];
        self.place_samples(paths);
        for start in (0..paths.len()).step_by(LANES) {
            let [x, y] = [sixteen(self.x, start), sixteen(self.y, start)];
            let across = shares(x, sixteen(self.across, start), width);
            let down = shares(y, sixteen(self.down, start), height);
            self.rays.set_dirs(start, &frame.view.dirs(F32x16::new(across), F32x16::new(down)));
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

/// Where in the picture the centres of up to sixteen pixels are.
#[inline(always)]
fn sixteen_centers(centers: &Centers, places: &[Place], corner: Place) -> [[f32; LANES]; 2] {
    let within = |place: Place| -> [usize; 2] {
        each(|axis| ((place[axis] - corner[axis]) % LARGEST_SIDE) as usize)
    };
    let [left, top] = within(places[0]);
    if (left | top) % 4 == 0 && places.len() == LANES && within(places[15]) == [left + 3, top + 3] {
        // No pixel of this block of the curve is left out, so they stand in its order.
        let [columns, rows] = [four(&centers[0], left), four(&centers[1], top)];
        return [
            each(|lane| columns[usize::from(CURVE[lane][0])]),
            each(|lane| rows[usize::from(CURVE[lane][1])]),
        ];
    }
    let mut at = [[0.0; LANES]; 2];
    for (lane, &place) in places.iter().enumerate() {
        let [x, y] = within(place);
        (at[0][lane], at[1][lane]) = (centers[0][x], centers[1][y]);
    }
    at
}

#[inline(always)]
fn four(array: &[f32], start: usize) -> [f32; 4] {
    array[start..start + 4].try_into().expect("four of a tile's columns or rows")
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
