//! Primitives that are large for where they are, such as the ground under a town: taken out of a range
//! before it is split.
//!
//! A split by centres leaves such a primitive with one of both halves, whose box stays as large as it
//! was; so on down to the leaves. Beside the rest it is one child more, and all that is below the rest
//! has small boxes.

use rayon::prelude::*;

use super::binning::{self, Binned, Range};
use super::build::CHUNK;
use super::node::MAX_LEAF;

/// A primitive is outsized if its box has this share of the surface of its range's box. The walls of an
/// empty room have a third each. With a half, rays in the sphereflake are 0.99 times as fast, others the same.
const SHARE: f32 = 0.25;

/// Smaller ranges are split as they are: below, boxes of neighbours are alike, and leaves would get less
/// full (from 9 on, rays of the mixed scene are 0.96 times as fast).
const FEWEST: usize = 32;

/// Partitions a range: the outsized from the others if there are some, else by the cheapest split. The size
/// of its first part, and both parts' boxes; `None` if all centres are in one bin.
#[inline(always)]
pub(super) fn split<B: Binned>(
    primitives: &mut [B],
    range: &mut Range,
    area_scale: f32,
) -> Option<(usize, [Range; 2])> {
    if let Some(parts) = part(primitives, range, area_scale) {
        return Some(parts);
    }
    let split = binning::cheapest_split(primitives, *range, area_scale)?;
    Some(split.partition(primitives))
}

/// Puts the outsized in front, if there are some, and so few that a leaf can hold them: how many, and what
/// is to be known of them and of the others. `None` leaves all as it was, but for `range`, which may know
/// its largest primitive afterwards.
#[inline(always)]
fn part<B: Binned>(
    primitives: &mut [B],
    range: &mut Range,
    area_scale: f32,
) -> Option<(usize, [Range; 2])> {
    if primitives.len() < FEWEST {
        return None;
    }
    let limit = SHARE * range.bounds.half_area(area_scale);
    if range.largest < limit { None } else { part_by(primitives, range, area_scale, limit) }
}

#[inline(never)]
fn part_by<B: Binned>(
    primitives: &mut [B],
    range: &mut Range,
    area_scale: f32,
    limit: f32,
) -> Option<(usize, [Range; 2])> {
    let survey = |chunk: &[B]| {
        chunk.iter().fold((0.0, 0), |(largest, count): (f32, usize), one| {
            let area = one.lone_area(area_scale);
            (largest.max(area), count + usize::from(area >= limit))
        })
    };
    let (largest, count) = primitives
        .par_chunks(CHUNK)
        .map(survey)
        .reduce(|| (0.0, 0), |a, b| (a.0.max(b.0), a.1 + b.1));
    range.largest = largest;
    if !(1..=MAX_LEAF).contains(&count) {
        return None;
    }
    let mut front = 0;
    for place in 0..primitives.len() {
        if primitives[place].lone_area(area_scale) >= limit {
            primitives.swap(place, front);
            front += 1;
        }
    }
    let (outsized, others) = primitives.split_at(front);
    Some((front, [Range::of(outsized), Range::of(others)]))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bvh::{BuildPrimitive, PrimKind};
    use crate::geometry::Aabb;

    /// Boxes in a row, and some among them that reach from end to end.
    fn row(small: usize, large: usize) -> Vec<BuildPrimitive> {
        let one = |id: usize| {
            let (from, to) = if id % 10 == 3 && id / 10 < large {
                (0.0, small as f32)
            } else {
                (id as f32, id as f32 + 1.0)
            };
            let bounds = Aabb { min: Vec3::new(from, 0.0, 0.0), max: Vec3::new(to, 1.0, 1.0) };
            BuildPrimitive::new(bounds, PrimKind::Triangle, id as u32)
        };
        (0..small).map(one).collect()
    }

    #[test]
    fn what_is_outsized_comes_in_front() {
        for large in 1..=MAX_LEAF {
            let mut primitives = row(100, large);
            let mut range = Range::of(&primitives);
            let (count, ranges) = part(&mut primitives, &mut range, 1.0).expect("some are");
            assert_eq!(count, large);
            assert!(primitives[..count].iter().all(|one| one.id() % 10 == 3));
            let (left, right) = primitives.split_at(count);
            for (range, side) in ranges.iter().zip([left, right]) {
                assert_eq!(range.bounds.aabb(), Range::of(side).bounds.aabb());
            }
            let mut ids: Vec<u32> = primitives.iter().map(BuildPrimitive::id).collect();
            ids.sort_unstable();
            assert!(ids.into_iter().eq(0..100));
        }
    }

    #[test]
    fn too_many_or_none_stay() {
        for (small, large) in [(100, 0), (100, MAX_LEAF + 1), (FEWEST - 1, 1)] {
            let mut primitives = row(small, large);
            let mut range = Range::of(&primitives);
            assert!(part(&mut primitives, &mut range, 1.0).is_none());
            assert!(primitives.iter().map(BuildPrimitive::id).eq(0..small as u32), "they moved");
        }
        let mut primitives = row(100, 0);
        let mut range = Range::of(&primitives);
        part(&mut primitives, &mut range, 1.0);
        assert_eq!(range.largest, 3.0, "the next one to ask need not look");
    }
}
