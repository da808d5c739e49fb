//! Primitives sorted along Morton's curve, for the fastest build (Lauterbach and others 2009, "Fast
//! BVH construction on GPUs").
//!
//! A centre's key is the number of its cell on the curve. Cells are cubes; an axis along which the
//! scene is shorter has fewer bits, so that a flat scene has as many cells as another. The sort is by
//! digits, the last first, in parts whose number follows from that of the primitives alone: the same
//! order for every number of threads.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec4;
use rayon::prelude::*;

use super::binning::{Binned, INTEGER, Range};
use super::clusters::{Cluster, Sorted, parts};
use super::primitive::{BuildPrimitive, SignedBox};

/// The bits of a key: [`DIGITS`] of [`DIGIT`] bits.
const BITS: u32 = DIGITS * DIGIT;
const DIGITS: u32 = 3;
const DIGIT: u32 = 10;

/// The most bits of one axis.
const MOST_ALONG: u32 = 16;

/// A cluster has at most so many primitives. Larger ones make the tree sooner and worse.
const CLUSTER: usize = 256;

/// The primitives in the order of the curve. `range` is that of all.
pub(super) fn sort(primitives: &[BuildPrimitive], range: Range) -> Sorted {
    let curve = Curve::new(range.centers);
    let mut pairs: Vec<AtomicU64> = Vec::new();
    let pair = |(place, one): (usize, &BuildPrimitive)| {
        AtomicU64::new(u64::from(curve.key(one.center())) << 32 | place as u64)
    };
    primitives.par_iter().enumerate().map(pair).collect_into_vec(&mut pairs);
    let mut other: Vec<AtomicU64> = Vec::new();
    pairs.par_iter().map(|_| AtomicU64::new(0)).collect_into_vec(&mut other);
    for digit in 0..DIGITS {
        by_digit(&pairs, &other, 32 + digit * DIGIT);
        std::mem::swap(&mut pairs, &mut other);
    }
    drop(other);
    let (mut keys, mut sorted) = (Vec::new(), Vec::new());
    let key = |pair: &AtomicU64| (pair.load(Ordering::Relaxed) >> 32) as u32;
    pairs.par_iter().map(key).collect_into_vec(&mut keys);
    let at = |pair: AtomicU64| primitives[pair.into_inner() as u32 as usize];
    pairs.into_par_iter().map(at).collect_into_vec(&mut sorted);

    let mut runs = Vec::new();
    cut(&keys, 0, &mut runs);
    let cluster = |(first, count): (u32, u32)| Cluster {
        range: Range::of(&sorted[first as usize..][..count as usize]),
        first,
        count,
    };
    let mut clusters = Vec::new();
    runs.into_par_iter().map(cluster).collect_into_vec(&mut clusters);
    Sorted { primitives: sorted, keys, clusters }
}

/// Where sorted keys, at least two, fall into two halves of a box of cells; in the middle if all are
/// the same.
#[inline(always)]
pub(super) fn middle(keys: &[u32]) -> usize {
    let (first, last) = (keys[0], keys[keys.len() - 1]);
    if first == last {
        return keys.len() / 2;
    }
    let bit = 1 << (first ^ last).ilog2();
    keys.partition_point(|key| key & bit == 0)
}

/// Cuts the keys, which start at `first`, into runs that are small enough.
fn cut(keys: &[u32], first: u32, runs: &mut Vec<(u32, u32)>) {
    if keys.len() <= CLUSTER {
        return runs.push((first, keys.len() as u32));
    }
    let (left, right) = keys.split_at(middle(keys));
    cut(left, first, runs);
    cut(right, first + left.len() as u32, runs);
}

/// Sorts `from` by one digit into `to`; what has the same digit keeps its order.
fn by_digit(from: &[AtomicU64], to: &[AtomicU64], shift: u32) {
    const VALUES: usize = 1 << DIGIT;
    let part = from.len().div_ceil(parts(from.len()));
    let digit = |pair: u64| (pair >> shift) as usize % VALUES;
    let count = |part: &[AtomicU64]| {
        let mut counts = [0_u32; VALUES];
        part.iter().for_each(|pair| counts[digit(pair.load(Ordering::Relaxed))] += 1);
        counts
    };
    let mut places: Vec<[u32; VALUES]> = from.par_chunks(part).map(count).collect();
    let mut next = 0;
    for value in 0..VALUES {
        for part in &mut places {
            next += std::mem::replace(&mut part[value], next);
        }
    }
    from.par_chunks(part).zip(&mut places).for_each(|(part, places)| {
        for pair in part {
            let pair = pair.load(Ordering::Relaxed);
            let place = &mut places[digit(pair)];
            to[*place as usize].store(pair, Ordering::Relaxed);
            *place += 1;
        }
    });
}

/// The cells, and how their places become keys.
struct Curve {
    origin: Vec4,
    scale: Vec4,
    last: Vec4,
    /// For each axis the bits of the low byte of a place where they are in a key, then of the high.
    spread: [[[u32; 256]; 2]; 3],
}

impl Curve {
    fn new(centers: SignedBox) -> Self {
        let (origin, size) = centers.min_and_size();
        let sizes = [size.x, size.y, size.z].map(|size| f64::from(size).min(1e39));
        let largest = sizes.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let bits = |along: u32| {
            let cells = sizes.map(|size| size / largest * f64::from(along).exp2());
            cells.map(|cells| cells.max(1.0).log2().ceil() as u32)
        };
        let along = (1..=MOST_ALONG).rev().find(|&along| bits(along).iter().sum::<u32>() <= BITS);
        let along = along.unwrap_or(1);
        let bits = bits(along);
        let scale = (f64::from(along).exp2() / largest).min(1e37) as f32;
        let last = bits.map(|bits| INTEGER + ((1_u32 << bits) - 1) as f32);
        let mut spread = [[[0; 256]; 2]; 3];
        let mut place = 0;
        for level in 0..along {
            for axis in (0..3).filter(|&axis| level < bits[axis]) {
                for (byte, into) in spread[axis][level as usize / 8].iter_mut().enumerate() {
                    *into |= (byte as u32 >> (level % 8) & 1) << place;
                }
                place += 1;
            }
        }
        let last = Vec4::new(last[0], last[1], last[2], INTEGER);
        Self { origin, scale: Vec4::new(scale, scale, scale, 0.0), last, spread }
    }

    #[inline(always)]
    fn key(&self, center: Vec4) -> u32 {
        // As in `Grid::place`: rounded down, a NaN becomes 0.
        let place = (center - self.origin) * self.scale + Vec4::splat(INTEGER - 0.5);
        let place = place.max(Vec4::splat(INTEGER)).min(self.last).to_array();
        let along = |axis: usize| {
            let place = place[axis].to_bits() as usize;
            let [low, high] = &self.spread[axis];
            low[place & 0xff] | high[place >> 8 & 0xff]
        };
        along(0) | along(1) | along(2)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bvh::PrimKind;
    use crate::geometry::Aabb;

    fn sorted(points: &[Vec3]) -> Sorted {
        let boxed = |(id, &point): (u32, &Vec3)| {
            BuildPrimitive::new(Aabb::of_points(&[point]), PrimKind::Sphere, id)
        };
        let primitives: Vec<BuildPrimitive> = (0..).zip(points).map(boxed).collect();
        let sorted = sort(&primitives, Range::of(&primitives));
        assert!(sorted.keys.is_sorted());
        let mut ids: Vec<u32> = sorted.primitives.iter().map(BuildPrimitive::id).collect();
        ids.sort_unstable();
        assert!(ids.into_iter().eq(0..points.len() as u32), "each once");
        let mut end = 0;
        for cluster in &sorted.clusters {
            assert!(cluster.first == end && (1..=CLUSTER as u32).contains(&cluster.count));
            end += cluster.count;
        }
        assert_eq!(end as usize, points.len());
        sorted
    }

    /// The points of a lattice, the last axis first.
    fn lattice([x, y, z]: [u32; 3]) -> Vec<Vec3> {
        let at = |place| [place / z / y % x, place / z % y, place % z];
        (0..x * y * z).map(|place| Vec3::from_array(at(place).map(|along| along as f32))).collect()
    }

    #[test]
    fn keys_are_interleaved_places() {
        let points = lattice([16, 16, 16]);
        let place = |point: &Vec3| {
            let bit = |level: u32| {
                (0..3)
                    .map(move |axis| (point[axis] as u32 >> level & 1) << (3 * level + axis as u32))
            };
            (0..4).flat_map(bit).sum::<u32>()
        };
        for (one, number) in sorted(&points).primitives.iter().zip(0..) {
            assert_eq!(place(&one.bounds().min), number, "{one:?}");
        }
    }

    #[test]
    fn flat_and_long_scenes_have_as_many_cells() {
        for sides in [[300, 300, 1], [1, 400, 200], [60_000, 1, 1], [2000, 5, 5]] {
            let mut points = lattice(sides);
            points.reverse();
            let mut keys = sorted(&points).keys;
            keys.dedup();
            assert_eq!(keys.len() as u32, sides.iter().product::<u32>(), "{sides:?}");
        }
        sorted(&[Vec3::ONE; 1000]);
        sorted(&[Vec3::splat(-1e38), Vec3::splat(1e38), Vec3::ZERO]);
    }

    #[test]
    fn keys_fall_apart_at_their_highest_bit() {
        assert_eq!(middle(&[0, 1, 2, 3, 4, 5]), 4);
        assert_eq!(middle(&[8, 9, 12, 13, 13]), 2);
        assert_eq!(middle(&[6, 7]), 1);
        assert_eq!(middle(&[5; 7]), 3);
    }
}
