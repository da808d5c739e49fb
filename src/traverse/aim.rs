//! What is known of a tile's groups as wholes: where they can go at all.
//!
//! Rays that all run through one point make a [`Cone`]: sharp bounds, few numbers. Others that run
//! alike make [`Beams`], one for each group. Rays that do not run alike have no aim.
//!
//! Coordinates are forwards: along the main axis of the rays, mirrored if they run towards smaller
//! coordinates.

use super::beams::Beams;
use super::cone::Cone;
use super::cull::{Reach, Slopes};
use super::group::Group;
use super::tile::GROUPS;
use super::{ones, pace};
use crate::bvh::Bvh;
use crate::kernels::{BeamAxes, beam_margin};
use crate::simd::{LaneMask, Lanes, each};

/// Rays whose direction has a smaller part along the tile's main axis, with the largest part from 1
/// to 2, have no aim: their slopes would grow beyond what the margins cover.
const SMALLEST_FORWARD: f32 = 0.25;

/// Rays of one origin whose slopes differ more within a group, both axes across added, are no fan:
/// they need tests of their own. Camera rays differ by a hundredth, shuffled ones by one; bounds of
/// 0.05 and 0.2 measured alike.
const WIDEST_FAN: f32 = 0.2;

/// Rays that pass a point within this many margins make a cone: the margins grow as much.
const LARGEST_MISS: f32 = 4.0;

/// Points farther away than this many times the largest coordinate in play are no apex: there the
/// rounding of their own coordinates passes the margins, and parallel rays seem to meet.
const FARTHEST_APEX: f32 = 4.0;

/// How the rays of a tile run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Run {
    /// All from one point: [`Aim::fan`] tells.
    Fan,
    /// All through one point: [`Aim::cone`] tells.
    Cone,
    /// Each group on its own: [`Aim::beams`] tells.
    Beams,
}

/// What is known of a tile's groups. It is kept for all tiles of a batch, since each part is larger than
/// what is worth moving.
pub(super) struct Aim {
    pub(super) fan: Cone<true>,
    pub(super) cone: Cone<false>,
    pub(super) beams: Beams,
}

impl Aim {
    /// Knows nothing yet.
    pub(super) fn new() -> Self {
        Self { fan: Cone::new(), cone: Cone::new(), beams: Beams::new() }
    }

    /// How the rays of these groups run, and which groups it is for: those of `live` whose rays all run
    /// forwards. `None` if there is none.
    pub(super) fn take<F: Lanes>(
        &mut self,
        groups: &[Group<F>; GROUPS],
        live: u32,
        bvh: &Bvh,
    ) -> Option<(Run, u32)> {
        let axes = main_axis(groups, live)?;
        let (aimed, all, widest) = slopes(groups, live, axes);
        if !pace::is_worth_an_aim(aimed, live) {
            return None;
        }
        let origin = shared_origin(groups, aimed);
        let farthest = match origin {
            Some(origin) => origin.into_iter().fold(0.0, |far: f32, part| far.max(part.abs())),
            None => farthest(groups, aimed),
        };
        let extent = farthest + bvh.extent;
        let margin = beam_margin(extent);
        if !margin.is_finite() {
            return None;
        }
        if let Some(origin) = origin {
            let apex = axes.turn(origin);
            let reach = |reach: &mut Reach| reach.take_from(groups, aimed, axes, margin, apex[2]);
            if widest <= WIDEST_FAN && self.fan.take(axes, apex, origin, &all, reach) {
                return Some((Run::Fan, aimed));
            }
            if self.cone.take(axes, apex, [0.0; 3], &all, reach) {
                return Some((Run::Cone, aimed));
            }
        }
        let is_near = |apex: &[f32; 3]| {
            // Asked this way round, a NaN is far away.
            apex.iter().all(|part| part.abs() <= FARTHEST_APEX * extent)
        };
        for apex in apexes(groups, aimed, axes).into_iter().filter(is_near) {
            let Some(miss) = largest_miss(groups, aimed, axes, apex, LARGEST_MISS * margin) else {
                continue;
            };
            let reach = |reach: &mut Reach| reach.take(groups, aimed, axes, margin + miss);
            if self.cone.take(axes, apex, [0.0; 3], &all, reach) {
                return Some((Run::Cone, aimed));
            }
        }
        self.beams.take(groups, aimed, axes, margin, &all);
        Some((Run::Beams, aimed))
    }
}

/// The groups of `live` whose rays all run forwards, the bounds of their slopes, and how far the slopes of
/// one of them differ at most, both axes across added.
fn slopes<F: Lanes>(groups: &[Group<F>; GROUPS], live: u32, axes: BeamAxes) -> (u32, Slopes, f32) {
    let mut all = Slopes::new();
    let (inf, neg) = (F::splat(f32::INFINITY), F::splat(f32::NEG_INFINITY));
    let (mut aimed, mut widest) = (0, 0.0_f32);
    for index in ones(live) {
        let group = &groups[index];
        let ray = &group.ray;
        let backwards =
            axes.forward(&ray.dir).lt(F::splat(SMALLEST_FORWARD)) | ray.t_min.lt(F::splat(0.0));
        if (ray.valid & backwards).any() {
            continue;
        }
        let slopes = group.slopes(axes);
        let [min, max] = F::reduce_bounds(
            each(|across| F::select(ray.valid, slopes[across], inf)),
            each(|across| F::select(ray.valid, slopes[across], neg)),
        );
        let spread = (max[0] - min[0]) + (max[1] - min[1]);
        aimed |= 1 << index;
        widest = widest.max(spread);
        [all.min[0][index], all.min[1][index]] = min;
        [all.max[0][index], all.max[1][index]] = max;
    }
    (aimed, all, widest)
}

/// The largest distance of an origin from zero, along any axis.
fn farthest<F: Lanes>(groups: &[Group<F>; GROUPS], live: u32) -> f32 {
    let mut farthest = F::splat(0.0);
    for index in ones(live) {
        let [x, y, z] = &groups[index].ray.origin;
        farthest = farthest.max(x.abs().max(y.abs()).max(z.abs()));
    }
    farthest.reduce_max()
}

/// The point at which all rays start, if there is one.
fn shared_origin<F: Lanes>(groups: &[Group<F>; GROUPS], live: u32) -> Option<[f32; 3]> {
    let first = &groups[live.trailing_zeros() as usize].ray;
    let lane = first.valid.bits().trailing_zeros() as usize;
    let origin = each(|axis| first.origin[axis].lane(lane));
    let shared: [F; 3] = each(|axis| F::splat(origin[axis]));
    let elsewhere = ones(live).any(|index| {
        let ray = &groups[index].ray;
        let here =
            ray.origin[0].eq(shared[0]) & ray.origin[1].eq(shared[1]) & ray.origin[2].eq(shared[2]);
        (ray.valid & !here).any()
    });
    (!elsewhere).then_some(origin)
}

/// The axis along which the rays run in the mean.
fn main_axis<F: Lanes>(groups: &[Group<F>; GROUPS], live: u32) -> Option<BeamAxes> {
    let mut sum = [F::splat(0.0); 3];
    for index in ones(live) {
        let ray = &groups[index].ray;
        for (sum, &part) in sum.iter_mut().zip(&ray.dir) {
            *sum = *sum + F::select(ray.valid, part, F::splat(0.0));
        }
    }
    let sum: [f32; 3] = each(|axis| (0..F::LANES).map(|lane| sum[axis].lane(lane)).sum());
    let main = (0..3).max_by(|&a, &b| sum[a].abs().total_cmp(&sum[b].abs()))?;
    Some(BeamAxes { main, mirrored: sum[main] < 0.0 })
}

/// Points that all rays may run through, in the beam's axes: where the first ray ends, and where it
/// meets the last one. Not finite if there is none.
fn apexes<F: Lanes>(groups: &[Group<F>; GROUPS], live: u32, axes: BeamAxes) -> [[f32; 3]; 2] {
    let ray = |group: usize, lane: usize| {
        let (origin, slopes) = (axes.turn(groups[group].ray.origin), groups[group].slopes(axes));
        (each(|axis| origin[axis].lane(lane)), each(|across| slopes[across].lane(lane)))
    };
    let first = live.trailing_zeros() as usize;
    let last = live.ilog2() as usize;
    let lane = groups[first].ray.valid.bits().trailing_zeros() as usize;
    let (one, slope): ([f32; 3], [f32; 2]) = ray(first, lane);
    let (other, other_slope) = ray(last, groups[last].ray.valid.bits().ilog2() as usize);
    let dir = axes.turn(groups[first].ray.dir);
    let t_max = groups[first].ray.t_max.lane(lane);
    let end: [f32; 3] = each(|axis| one[axis] + dir[axis].lane(lane) * t_max);
    // Where both have the same coordinate, on the axis on which they part faster.
    let part = [slope[0] - other_slope[0], slope[1] - other_slope[1]];
    let across = if part[0].abs() > part[1].abs() { 0 } else { 1 };
    let at_zero = |origin: [f32; 3], slope: [f32; 2]| origin[across] - slope[across] * origin[2];
    let main = (at_zero(other, other_slope) - at_zero(one, slope)) / part[across];
    let step = main - one[2];
    let meeting = [one[0] + slope[0] * step, one[1] + slope[1] * step, main];
    [end, meeting]
}

/// How far rays pass by the apex at most; `None` as soon as one passes by farther than `limit`.
fn largest_miss<F: Lanes>(
    groups: &[Group<F>; GROUPS],
    live: u32,
    axes: BeamAxes,
    apex: [f32; 3],
    limit: f32,
) -> Option<f32> {
    let mut miss = F::splat(0.0);
    for index in ones(live) {
        let ray = &groups[index].ray;
        let origin = axes.turn(ray.origin);
        let step = F::splat(apex[2]) - origin[2];
        let slopes = groups[index].slopes(axes);
        let off = |across: usize| {
            let at = slopes[across].mul_add_fast(step, origin[across]);
            (at - F::splat(apex[across])).abs()
        };
        let (off_x, off_y) = (off(0), off(1));
        // Asked this way round, a NaN is a miss.
        let near = off_x.le(F::splat(limit)) & off_y.le(F::splat(limit));
        if (ray.valid & !near).any() {
            return None;
        }
        miss = F::select(ray.valid, off_x.max(off_y), F::splat(0.0)).max(miss);
    }
    Some(miss.reduce_max())
}
