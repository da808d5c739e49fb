//! Whether what comes one after the other lies far apart: a few runs of neighbours tell.

use glam::Vec3;

/// How many runs of neighbours are looked at, and how many rays or points each has.
pub(super) const LOOKS: usize = 64;
const RUN: usize = 16;

/// They are in no order if a run is spread by more than this share of what all are, in the mean. It is
/// nearly 0.9 if they are chosen at random, and a few hundredths in tiles or rows of a picture.
pub(super) const LARGEST_SHARE: f32 = 0.4;

/// The numbers of one run, of so many in all, at least [`LOOKS`] runs.
pub(super) fn run(look: usize, count: usize) -> impl Iterator<Item = usize> {
    (0..RUN).map(move |place| look * (count / LOOKS) + place)
}

/// The smallest and the largest coordinates, NaN aside.
pub(super) fn bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    let with = |pick: fn(f32, f32) -> f32, one: Vec3, other: Vec3| {
        Vec3::new(pick(one.x, other.x), pick(one.y, other.y), pick(one.z, other.z))
    };
    points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| {
        (with(f32::min, low, point), with(f32::max, high, point))
    })
}
