//! Rays in no order, put in one: those that leave a common point alike become neighbours.
//!
//! Each ray moves twice, each time over short ways, and so does what it found:
//! 1. Rows of eight numbers, or of three if rays differ in their directions alone, go to buckets, by the
//!    upper bits of their keys (see `pencil`). The lower bits come last in each row: one write a ray, to a place
//!    that is hardly ever at hand.
//! 2. A bucket fits into the second cache. Its rays go to a `run`, by the lower bits, and are traced there.
//! 3. What a ray found goes to the place that it has in the buckets, and from there to its caller's.
//!
//! With threads, each has buckets for a part of the rays; a bucket is then read part by part. So nobody
//! writes what another one reads.

use bytemuck::Pod;

use super::batch::share_alone;
use super::pencil::{KEY_BITS, Pencil};
use super::run::{ALL, CELL_BITS, CELLS, DIRS, Run};
use crate::batch_rays::{BatchRays, Start};
use crate::bvh::Bvh;
use crate::pages::Pages;
use crate::share_out::share_out;

/// Rays are sorted if tiles leave at least this share of them alone. In views from near, from far, from
/// inside and at a grazing angle of four scenes it was 0.03 to 0.09 where the sort lost (most rays met
/// nothing, 0.3 to 0.7 of the speed), and 0.59 to 1 where it won.
const LEAST_ALONE: f32 = 0.3;

/// The bits that choose a bucket: each is a line of the cache that is written to, and with 8 bits they all
/// fit. With 9 and 10 for cells in place of 11 and 9 camera rays of bunny, atrium and terrain, 2^20 of them,
/// are 1.05, 1.03, 1.07 times as fast, with 8 and 11 1.07, 1.04, 1.09, shadow rays 0.97, 0.98, 1.06.
const BUCKET_BITS: u32 = 8;

/// How many rays are traced at once, or a bucket more.
const RUN: usize = 1 << 13;

/// How many rays a thread should have at least.
const LEAST_SHARE: usize = 1 << 16;

/// Some of the rays, bucket by bucket.
struct Part {
    rows: Pages<f32>,
    width: usize,
    /// Where each bucket starts, and where the last one ends.
    starts: Vec<u32>,
}

/// Rays in another order than the caller's.
pub(crate) struct Sorted {
    /// What all rays have in common but for their directions.
    shared: Option<Start>,
    parts: Vec<Part>,
    /// Where each bucket of all parts starts, and where the last one ends.
    starts: Vec<u32>,
    /// Where each of the caller's rays is in the buckets of all parts.
    places: Pages<u32>,
}

impl Sorted {
    /// Sorts the rays, on the rayon pool if `parallel`. `None` if that is not worth it.
    pub(crate) fn new(rays: &BatchRays<'_>, bvh: &Bvh, parallel: bool) -> Option<Self> {
        Some(Self::by_keys(rays, &Self::worth(rays, bvh)?, parallel))
    }

    /// True if [`Sorted::new`] would sort the rays.
    pub(crate) fn is_worth(rays: &BatchRays<'_>, bvh: &Bvh) -> bool {
        Self::worth(rays, bvh).is_some()
    }

    /// What the rays are sorted by, if that is worth it.
    fn worth(rays: &BatchRays<'_>, bvh: &Bvh) -> Option<Pencil> {
        let size = (bvh.bounds.max - bvh.bounds.min).max_element();
        let pencil = Pencil::of(rays, size)?;
        let alone = share_alone(bvh, Pencil::sample(rays).as_rays());
        (alone >= LEAST_ALONE).then_some(pencil)
    }

    fn by_keys(rays: &BatchRays<'_>, pencil: &Pencil, parallel: bool) -> Self {
        let count = rays.len();
        let shift = KEY_BITS - BUCKET_BITS;
        let buckets = 1 << BUCKET_BITS;
        let share = if parallel {
            count.div_ceil(rayon::current_num_threads()).max(LEAST_SHARE)
        } else {
            count
        };

        // First the keys and how many rays each bucket gets.
        let mut places = Pages::new(count);
        let first = rays.start(0);
        let surveys = each_part(&mut places, share, |start, keys| {
            let rays = rays.range(start, start + keys.len());
            pencil.keys(&rays, keys);
            let mut counts = vec![0; buckets];
            keys.iter().for_each(|&key| counts[(key >> shift) as usize] += 1);
            (counts, rays.all_have(&first))
        });
        let shared = surveys.iter().all(|(_, alike)| *alike).then_some(first);
        let counts: Vec<Vec<u32>> = surveys.into_iter().map(|(counts, _)| counts).collect();

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
                shared.is_some(),
                keys,
                shift,
                &counts[part],
                &in_all[part],
            )
        });
        Self { shared, parts, starts, places }
    }

    /// Traces the rays, on the rayon pool if there are parts, and gives what they found, in the order
    /// of the buckets. `trace` gets some rays and the places to which it is to write what each found.
    pub(crate) fn trace<T: Pod + Send>(
        &self,
        trace: impl Fn(BatchRays<'_>, &[u32], &mut [T]) + Sync,
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
        let parallel = shares.len() > 1;
        share_out(shares.into_iter(), parallel, |(buckets, found)| {
            self.trace_buckets(buckets, found, &trace);
        });
        found
    }

    fn trace_buckets<T: Pod>(
        &self,
        buckets: std::ops::Range<usize>,
        found: &mut [T],
        trace: &impl Fn(BatchRays<'_>, &[u32], &mut [T]),
    ) {
        let base = self.starts[buckets.start];
        let mut run = Run::new(self.shared);
        for bucket in buckets.clone() {
            run.add(self.parts.iter().map(|part| part.bucket(bucket)), self.starts[bucket] - base);
            if run.places.len() >= RUN || bucket + 1 == buckets.end {
                trace(run.rays(), &run.places, found);
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
    let parallel = share < places.len();
    let mut results: Vec<Option<T>> = Vec::new();
    results.resize_with(places.len().div_ceil(share.max(1)), || None);
    let parts = places.chunks_mut(share.max(1)).zip(&mut results).enumerate();
    share_out(parts, parallel, |(part, (places, result))| {
        *result = Some(work(part * share, places));
    });
    results.into_iter().flatten().collect()
}

impl Part {
    /// Puts rays into buckets, so many in each; keys become places among all rays, where each bucket's
    /// first one goes to `in_all`.
    fn new(
        rays: &BatchRays<'_>,
        dirs_alone: bool,
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
        let width = if dirs_alone { DIRS } else { ALL };
        let mut rows = Pages::new(width * keys.len());
        let mut ends: Vec<(u32, u32)> =
            starts.iter().zip(in_all).map(|(&here, &there)| (here, there)).collect();
        let mut place = |key: &mut u32| {
            let (here, there) = &mut ends[(*key >> shift) as usize];
            let at = *here as usize;
            let cell = (*key >> (shift - CELL_BITS)) % CELLS as u32;
            *key = *there;
            (*here, *there) = (*here + 1, *there + 1);
            (at, f32::from_bits(cell))
        };
        if dirs_alone {
            let rows = rows.as_chunks_mut::<DIRS>().0;
            rays.for_each_dir(|index, [x, y, z]| {
                let (at, cell) = place(&mut keys[index]);
                rows[at] = [x, y, z, cell];
            });
        } else {
            let rows = rows.as_chunks_mut::<ALL>().0;
            rays.for_each(|index, [x, y, z, dx, dy, dz, t_min, t_max]| {
                let (at, cell) = place(&mut keys[index]);
                rows[at] = [x, y, z, dx, dy, dz, t_min, t_max, cell];
            });
        }
        Self { rows, width, starts }
    }

    fn bucket(&self, bucket: usize) -> &[f32] {
        let (start, end) = (self.starts[bucket] as usize, self.starts[bucket + 1] as usize);
        &self.rows[start * self.width..end * self.width]
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::ray::{Ray, RayBatch};

    /// Each ray is traced once, with neighbours, and gets its own answer back.
    #[test]
    fn rays_come_back_to_their_places() {
        let count = 2 * LEAST_SHARE + 77;
        let number = |index: usize| index * 40_503 % count;
        let ray = |index: usize| {
            let number = number(index);
            let at = Vec3::new((number % 400) as f32, (number / 400) as f32, 400.0);
            Ray { origin: Vec3::ONE, dir: at, t_min: 0.5, t_max: f32::INFINITY }
        };
        let mut index_of = vec![0; count];
        (0..count).for_each(|index| index_of[number(index)] = index);
        let mut rays: RayBatch = (0..count).map(ray).collect();
        come_back(&rays, true, |ray| index_of[(ray.dir.x + 400.0 * ray.dir.y) as usize]);
        // One ray apart from the others: all fields count.
        rays.t_max[count - 1] = 7.0;
        come_back(&rays, false, |ray| index_of[(ray.dir.x + 400.0 * ray.dir.y) as usize]);
        (0..count).for_each(|index| rays.t_min[index] = index as f32);
        come_back(&rays, false, |ray| ray.t_min as usize);
    }

    fn come_back(rays: &RayBatch, is_shared: bool, index_of: impl Fn(&Ray) -> usize + Sync) {
        let count = rays.len();
        let rays_of = |index| rays.as_rays().get(index);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
        for parallel in [false, true] {
            let steps = std::sync::Mutex::new(0.0);
            let pencil = Pencil::of(&rays.as_rays().into(), 1.0).expect("these are in no order");
            let sorted =
                pool.install(|| Sorted::by_keys(&rays.as_rays().into(), &pencil, parallel));
            assert_eq!(sorted.parts.len() > 1, parallel);
            assert_eq!(sorted.shared.is_some(), is_shared);
            let found = sorted.trace(|rays, places, found: &mut [u32]| {
                assert_eq!(rays.len(), places.len());
                for (index, &place) in places.iter().enumerate() {
                    let ray = rays.get(index);
                    assert_eq!(ray, rays_of(index_of(&ray)));
                    found[place as usize] = 1 + index_of(&ray) as u32;
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
