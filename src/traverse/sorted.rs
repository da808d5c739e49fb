//! Rays in no order, put in one: those that leave a common point alike become neighbours.
//!
//! Each ray moves twice, each time over short ways, and so does what it found:
//! 1. Rows of eight numbers go to buckets, by the upper bits of their keys (see `pencil`).
//! 2. A bucket fits into the cache. Its rays go to arrays, by the lower bits, and are traced there.
//! 3. What a ray found goes to the place that it has in the buckets, and from there to its caller's.
//!
//! With threads, each has buckets for a part of the rays; a bucket is then read part by part. So nobody
//! writes what another one reads.

use rayon::prelude::*;

use bytemuck::Pod;

use super::batch::share_alone;
use super::pencil::{KEY_BITS, Pencil};
use crate::bvh::Bvh;
use crate::pages::Pages;
use crate::ray::{RayBatch, Rays};
use crate::rows::BatchRays;

/// Rays are sorted if tiles leave at least this share of them alone. In views from near, from far, from
/// inside and at a grazing angle of four scenes it was 0.03 to 0.09 where the sort lost (most rays met
/// nothing, 0.3 to 0.7 of the speed), and 0.59 to 1 where it won.
const LEAST_ALONE: f32 = 0.3;

/// How many rays a bucket should have. With 5 to 12 bits for buckets, camera rays and shadow rays of the
/// bunny, the atrium and the terrain, 2^20 of them, differ by a tenth, and from 8 bits on by a twentieth.
const BUCKET: usize = 512;

/// The most bits that choose a bucket: each is a place in memory that is written to.
const MOST_BUCKET_BITS: u32 = 11;

/// The bits that order the rays of a bucket.
const CELL_BITS: u32 = 9;
const CELLS: usize = 1 << CELL_BITS;

/// How many rays are traced at once, or a bucket more.
const RUN: usize = 1 << 13;

/// How many rays a thread should have at least.
const LEAST_SHARE: usize = 1 << 16;

/// The fields of a ray, in the order of [`Rays`].
type Row = [f32; WIDTH];
const WIDTH: usize = 8;

/// Some of the rays, bucket by bucket.
struct Part {
    rows: Pages<Row>,
    /// What orders each ray in its bucket.
    cells: Pages<u16>,
    /// Where each bucket starts, and where the last one ends.
    starts: Vec<u32>,
}

/// Rays in another order than the caller's.
pub(crate) struct Sorted {
    parts: Vec<Part>,
    /// Where each bucket of all parts starts, and where the last one ends.
    starts: Vec<u32>,
    /// Where each of the caller's rays is in the buckets of all parts.
    places: Pages<u32>,
}

impl Sorted {
    /// Sorts the rays, on the rayon pool if `parallel`. `None` if that is not worth it.
    pub(crate) fn new(rays: &BatchRays<'_>, bvh: &Bvh, parallel: bool) -> Option<Self> {
        let size = (bvh.bounds.max - bvh.bounds.min).max_element();
        let pencil = Pencil::of(rays, size)?;
        if share_alone(bvh, Pencil::sample(rays).as_rays()) < LEAST_ALONE {
            return None;
        }
        Some(Self::by_keys(rays, &pencil, parallel))
    }

    fn by_keys(rays: &BatchRays<'_>, pencil: &Pencil, parallel: bool) -> Self {
        let count = rays.len();
        let bucket_bits = (count / BUCKET).max(2).ilog2().min(MOST_BUCKET_BITS);
        let shift = KEY_BITS - bucket_bits;
        let buckets = 1 << bucket_bits;
        let share = if parallel {
            count.div_ceil(rayon::current_num_threads()).max(LEAST_SHARE)
        } else {
            count
        };

        // First the keys and how many rays each bucket gets.
        let mut places = Pages::new(count);
        let counts = each_part(&mut places, share, |start, keys| {
            pencil.keys(&rays.range(start, start + keys.len()), keys);
            let mut counts = vec![0; buckets];
            keys.iter().for_each(|&key| counts[(key >> shift) as usize] += 1);
            counts
        });

        // Then where that is, in the part and in all.
        let mut starts = vec![0];
        let mut in_all: Vec<Vec<u32>> =
            counts.iter().map(|_| Vec::with_capacity(buckets)).collect();
        let mut next = 0;
        for bucket in 0..buckets {
            for (places, counts) in in_all.iter_mut().zip(&counts) {
                places.push(next);
                next += counts[bucket];
            }
            starts.push(next);
        }

        let parts = each_part(&mut places, share, |start, keys| {
            let part = start / share;
            Part::new(
                &rays.range(start, start + keys.len()),
                keys,
                shift,
                &counts[part],
                &in_all[part],
            )
        });
        Self { parts, starts, places }
    }

    /// Traces the rays, on the rayon pool if there are parts, and gives what they found, in the order
    /// of the buckets. `trace` gets some rays and the places to which it is to write what each found.
    pub(crate) fn trace<T: Pod + Send>(
        &self,
        trace: impl Fn(Rays<'_>, &[u32], &mut [T]) + Sync,
    ) -> Pages<T> {
        let mut found = Pages::new(self.places.len());
        let mut shares = Vec::new();
        let (mut first, mut rest) = (0, &mut *found);
        for bucket in 1..self.starts.len() {
            let len = (self.starts[bucket] - self.starts[first]) as usize;
            let last = bucket + 1 == self.starts.len();
            if last || (self.parts.len() > 1 && len >= LEAST_SHARE) {
                let (share, more) = rest.split_at_mut(len);
                shares.push((first..bucket, share));
                (first, rest) = (bucket, more);
            }
        }
        if let [(buckets, found)] = shares.as_mut_slice() {
            self.trace_buckets(buckets.clone(), found, &trace);
        } else {
            shares.into_par_iter().with_max_len(1).for_each(|(buckets, found)| {
                self.trace_buckets(buckets, found, &trace);
            });
        }
        found
    }

    fn trace_buckets<T: Pod>(
        &self,
        buckets: std::ops::Range<usize>,
        found: &mut [T],
        trace: &impl Fn(Rays<'_>, &[u32], &mut [T]),
    ) {
        let base = self.starts[buckets.start];
        let mut run = Run::default();
        for bucket in buckets.clone() {
            run.add(self.parts.iter().map(|part| part.bucket(bucket)), self.starts[bucket] - base);
            if run.places.len() >= RUN || bucket + 1 == buckets.end {
                trace(run.rays.as_rays(), &run.places, found);
                run.clear();
            }
        }
    }

    /// What the caller's rays found, from the one with the number `start` on.
    pub(crate) fn give<'a, T: Copy>(
        &'a self,
        found: &'a [T],
        start: usize,
    ) -> impl Iterator<Item = T> + 'a {
        self.places[start..].iter().map(|&place| found[place as usize])
    }
}

/// Does `work` for each part of `places`, which starts at the first argument.
fn each_part<T: Send>(
    places: &mut [u32],
    share: usize,
    work: impl Fn(usize, &mut [u32]) -> T + Sync,
) -> Vec<T> {
    if share >= places.len() {
        return vec![work(0, places)];
    }
    places
        .par_chunks_mut(share)
        .enumerate()
        .map(|(part, places)| work(part * share, places))
        .collect()
}

impl Part {
    /// Puts rays into buckets, so many in each; keys become places among all rays, where each bucket's
    /// first one goes to `in_all`.
    fn new(
        rays: &BatchRays<'_>,
        keys: &mut [u32],
        shift: u32,
        counts: &[u32],
        in_all: &[u32],
    ) -> Self {
        let mut starts = Vec::with_capacity(counts.len() + 1);
        let mut next = 0;
        for count in counts {
            starts.push(next);
            next += count;
        }
        starts.push(next);
        let mut all_rows = Pages::new(keys.len());
        let mut all_cells = Pages::new(keys.len());
        let (rows, cells): (&mut [Row], &mut [u16]) = (&mut all_rows, &mut all_cells);
        let mut ends: Vec<(u32, u32)> =
            starts.iter().zip(in_all).map(|(&here, &there)| (here, there)).collect();
        rays.for_each(|index, row| {
            let key = &mut keys[index];
            let (here, there) = &mut ends[(*key >> shift) as usize];
            rows[*here as usize] = row;
            cells[*here as usize] = (*key >> (shift - CELL_BITS)) as u16 % CELLS as u16;
            *key = *there;
            (*here, *there) = (*here + 1, *there + 1);
        });
        Self { rows: all_rows, cells: all_cells, starts }
    }

    fn bucket(&self, bucket: usize) -> (&[Row], &[u16]) {
        let range = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
        (&self.rows[range.clone()], &self.cells[range])
    }
}

/// Rays in order, and their places in the buckets.
#[derive(Default)]
struct Run {
    rays: RayBatch,
    places: Vec<u32>,
}

impl Run {
    fn clear(&mut self) {
        self.rays.clear();
        self.places.clear();
    }

    /// Appends the rays of one bucket, which come part by part; the first one has place `place`.
    fn add<'a>(
        &mut self,
        parts: impl Iterator<Item = (&'a [Row], &'a [u16])> + Clone,
        mut place: u32,
    ) {
        let mut ends = [0_u32; CELLS];
        for (_, cells) in parts.clone() {
            cells.iter().for_each(|&cell| ends[cell as usize % CELLS] += 1);
        }
        let mut next = self.places.len() as u32;
        for end in &mut ends {
            (*end, next) = (next, next + *end);
        }
        let count = next as usize;
        let rays = &mut self.rays;
        let mut fields = [
            &mut rays.origin_x,
            &mut rays.origin_y,
            &mut rays.origin_z,
            &mut rays.dir_x,
            &mut rays.dir_y,
            &mut rays.dir_z,
            &mut rays.t_min,
            &mut rays.t_max,
        ]
        .map(|field| {
            field.resize(count, 0.0);
            field.as_mut_slice()
        });
        self.places.resize(count, 0);
        for (rows, cells) in parts {
            for (row, &cell) in rows.iter().zip(cells) {
                let end = &mut ends[cell as usize % CELLS];
                for (field, &value) in fields.iter_mut().zip(row) {
                    field[*end as usize] = value;
                }
                self.places[*end as usize] = place;
                (*end, place) = (*end + 1, place + 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::ray::Ray;

    /// Each ray is traced once, with neighbours, and gets its own answer back.
    #[test]
    fn rays_come_back_to_their_places() {
        let count = 2 * LEAST_SHARE + 77;
        let ray = |index: usize| {
            let number = index * 40_503 % count;
            let at = Vec3::new((number % 400) as f32, (number / 400) as f32, 400.0);
            Ray { origin: Vec3::ONE, dir: at, t_min: index as f32, t_max: f32::INFINITY }
        };
        let rays: RayBatch = (0..count).map(ray).collect();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
        for parallel in [false, true] {
            let steps = std::sync::Mutex::new(0.0);
            let pencil = Pencil::of(&rays.as_rays().into(), 1.0).expect("these are in no order");
            let sorted =
                pool.install(|| Sorted::by_keys(&rays.as_rays().into(), &pencil, parallel));
            assert_eq!(sorted.parts.len() > 1, parallel);
            let found = sorted.trace(|rays, places, found: &mut [u32]| {
                assert_eq!(rays.len(), places.len());
                for (index, &place) in places.iter().enumerate() {
                    found[place as usize] = 1 + rays.t_min[index] as u32;
                }
                let dir = |index: usize| rays.get(index).dir;
                let sum: f32 = (1..rays.len()).map(|i| dir(i).distance(dir(i - 1))).sum();
                *steps.lock().expect("nothing fails") += sum;
            });
            let expected: Vec<u32> = (1..=count as u32).collect();
            assert_eq!(sorted.give(&found, 0).collect::<Vec<_>>(), expected);
            assert_eq!(sorted.give(&found, 999).next(), Some(1000));
            assert!(steps.into_inner().expect("nothing fails") < 4.0 * count as f32);
        }
    }
}
