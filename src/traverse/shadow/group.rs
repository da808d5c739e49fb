//! Sixteen points side by side: their shafts to the light.

use super::{AreaLight, Query};
use crate::kernels::{Beam, BeamAxes, Bounds, Pyramids, beam_margin};
use crate::points::{LightSamples, Points};
use crate::simd::{F32x16, LaneMask, Lanes, each};

/// How many points a group has.
pub(super) const LANES: usize = 16;

/// Points that have a direction to the light with a smaller part along the block's main axis, in
/// units of its largest, have no shaft: slopes would grow beyond what the margins cover.
const SMALLEST_FORWARD: f32 = 0.25;

/// What all groups of a block have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    pub(super) axes: BeamAxes,
    /// How far everything in the scene, the points and the light is away from zero, added up.
    extent: f32,
    pub(super) margin: f32,
    /// Where the light ends along the main axis, plus the margin.
    pub(super) end: f32,
    light: AreaLight,
}

impl Aim {
    /// From the points to the light, in a scene of this extent. Meaningful if all is finite.
    pub(super) fn new(points: &Points<'_>, light: AreaLight, scene_extent: f32) -> Self {
        let center = light.corner + (light.edge_u + light.edge_v) * 0.5;
        let zero = F32x16::splat(0.0);
        let (mut sum, mut farthest) = ([0.0; 3], zero);
        for (axis, positions) in points.position.iter().enumerate() {
            let mut sums = zero;
            for start in (0..positions.len()).step_by(LANES) {
                let at = loaded(positions, start, (positions.len() - start).min(LANES));
                let size = Lanes::abs(at);
                let finite = Lanes::le(size, F32x16::splat(f32::MAX));
                let off = F32x16::splat(center[axis]) - at;
                sums += Lanes::select(finite, off, zero);
                farthest = Lanes::max(Lanes::select(finite, size, zero), farthest);
            }
            sum[axis] = sums.reduce_add();
        }
        let main = (0..3).fold(0, |a, b| if sum[b].abs() > sum[a].abs() { b } else { a });
        let axes = BeamAxes { main, mirrored: sum[main] < 0.0 };
        let reach = light.corner.abs() + light.edge_u.abs() + light.edge_v.abs();
        let extent = scene_extent + farthest.reduce_max() + reach.max_element();
        // Twice: directions of samples are as far off from the corners' as beams may be themselves.
        let margin = 2.0 * beam_margin(extent);
        let corners = light.corners().map(|corner| axes.turn(corner)[2]);
        let end = corners.into_iter().fold(f32::NEG_INFINITY, f32::max) + margin;
        Self { axes, extent, margin, end, light }
    }

    /// The lanes in which all directions, in the axes of the shafts, may be those of one shaft.
    #[inline(always)]
    pub(super) fn fit<const N: usize>(&self, dirs: [[F32x16; 3]; N]) -> <F32x16 as Lanes>::Mask {
        let zero = F32x16::splat(0.0);
        let mut fit = F32x16::mask(u32::MAX);
        let mut sum = zero;
        for [a, b, forward] in dirs {
            let across = Lanes::max(Lanes::abs(a), Lanes::abs(b));
            fit = fit
                & Lanes::ge(forward, across * F32x16::splat(SMALLEST_FORWARD))
                & Lanes::gt(forward, F32x16::splat(self.margin));
            // Zero times NaN or infinity is NaN, and stays so in the sum.
            sum += (a + b + forward) * zero;
        }
        fit & Lanes::eq(sum, zero)
    }
}

impl AreaLight {
    fn corners(&self) -> [[f32; 3]; 4] {
        let Self { corner, edge_u, edge_v } = *self;
        [corner, corner + edge_u, corner + edge_v, corner + edge_u + edge_v]
            .map(|point| point.to_array())
    }
}

/// Sixteen points.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointGroup {
    /// Their shafts: a beam each.
    pub(super) beam: Beam<F32x16>,
    pub(super) view: Pyramids<F32x16>,
    /// The points that nothing is known to stand before.
    pub(super) live: u32,
    /// The points whose samples all lie before their surface.
    pub(super) faces: u32,
    /// The points that only rays can settle; at first those that have no shaft.
    pub(super) unsure: u32,
    /// The points that have a shaft.
    pub(super) fit: u32,
}

impl PointGroup {
    /// The points of `query` from `start`, up to sixteen of them.
    pub(super) fn new<S: LightSamples + ?Sized>(
        query: &Query<'_, S>,
        start: usize,
        count: usize,
        aim: &Aim,
    ) -> Self {
        let load = |from: &[f32]| loaded(from, start, count);
        let apex = each(|axis| load(query.points.position[axis]));
        let turned = aim.axes.turn(apex);
        let corners = aim.light.corners().map(|corner| {
            let corner = aim.axes.turn(corner.map(F32x16::splat));
            [corner[0] - turned[0], corner[1] - turned[1], corner[2] - turned[2]]
        });
        let (inf, neg) = (F32x16::splat(f32::INFINITY), F32x16::splat(f32::NEG_INFINITY));
        let mut shortest = inf;
        let (mut slope_min, mut slope_max) = ([inf; 2], [neg; 2]);
        for [a, b, forward] in corners {
            shortest = Lanes::min(shortest, forward);
            let inverse = F32x16::splat(1.0) / forward;
            for (axis, part) in [a, b].into_iter().enumerate() {
                let slope = part * inverse;
                slope_min[axis] = Lanes::min(slope_min[axis], slope);
                slope_max[axis] = Lanes::max(slope_max[axis], slope);
            }
        }
        let all = (1_u32 << count) - 1;
        let fit = aim.fit(corners).bits() & all;
        let light = [aim.light.corner, aim.light.edge_u, aim.light.edge_v];
        let view = Pyramids::new(apex, light.map(|v| v.to_array()), aim.extent, shortest);
        let (faces, hidden) = match query.points.normal {
            None => (all, 0),
            Some(normal) => {
                let normal = each(|axis| load(normal[axis]));
                let (low, high) = view.products(normal);
                let error = view.product_error(normal);
                (Lanes::gt(low, error).bits(), Lanes::lt(high, -error).bits())
            }
        };
        let margin = F32x16::splat(aim.margin);
        let chosen = F32x16::mask(fit);
        // Lanes without a shaft meet nothing.
        let or = |lanes, other| Lanes::select(chosen, lanes, other);
        let beam = Beam {
            origin: Bounds {
                min: turned.map(|part| or(part - margin, inf)),
                max: turned.map(|part| or(part + margin, neg)),
            },
            slope_min: slope_min.map(|slope| or(slope, inf)),
            slope_max: slope_max.map(|slope| or(slope, neg)),
            start: or(turned[2] - margin, inf),
        };
        Self { beam, view, live: fit & !hidden, faces: faces & all, unsure: all & !fit, fit }
    }
}

/// The values from `start` on, `count` of them; the other lanes repeat the first.
#[inline(always)]
pub(super) fn loaded(from: &[f32], start: usize, count: usize) -> F32x16 {
    if count == LANES {
        return F32x16::load(&from[start..]);
    }
    let mut lanes = [from[start]; LANES];
    lanes[..count].copy_from_slice(&from[start..start + count]);
    F32x16::load(&lanes)
}

/// The beam around the beams of all lanes, lane by lane of the result: `beams[lane]`.
pub(super) fn around<'a>(beams: impl Iterator<Item = &'a PointGroup>) -> Beam<F32x16> {
    let (inf, neg) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let (mut min, mut max) = ([inf; 3], [neg; 3]);
    let (mut slope_min, mut slope_max) = ([inf; 2], [neg; 2]);
    let mut start = inf;
    for (lane, PointGroup { beam, .. }) in beams.enumerate() {
        for axis in 0..3 {
            min[axis][lane] = beam.origin.min[axis].reduce_min();
            max[axis][lane] = beam.origin.max[axis].reduce_max();
        }
        for axis in 0..2 {
            slope_min[axis][lane] = beam.slope_min[axis].reduce_min();
            slope_max[axis][lane] = beam.slope_max[axis].reduce_max();
        }
        start[lane] = beam.start.reduce_min();
    }
    let load = |lanes: [f32; LANES]| F32x16::load(&lanes);
    Beam {
        origin: Bounds { min: min.map(load), max: max.map(load) },
        slope_min: slope_min.map(load),
        slope_max: slope_max.map(load),
        start: load(start),
    }
}
