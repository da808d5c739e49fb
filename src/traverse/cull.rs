//! Culling: what the bounds of a tile's groups must answer, and what all of them share.
//!
//! Coordinates are forwards: along the main axis of the rays, mirrored if they run towards smaller
//! coordinates.

use super::group::Group;
use super::ones;
use super::tile::GROUPS;
use crate::kernels::{BeamAxes, ScaledRay};
use crate::simd::{F32x8, F32x16, Lanes, each};

/// Culls boxes for the groups of a tile.
pub(super) trait Cull {
    /// Eight boxes made ready.
    type Boxes;
    /// True if groups should test boxes with their own rays too.
    const LOOSE: bool;
    /// True if groups have bounds at all.
    const BOUNDED: bool;
    /// True if all rays start at [`Cull::origin`], exactly.
    const FAN: bool;
    /// Where all rays of a fan start; else zero.
    fn origin(&self) -> [F32x8; 3] {
        [F32x8::ZERO; 3]
    }
    /// Makes boxes (`min.x .. max.z`) ready; a bit for each that some group may meet.
    fn boxes(&self, bounds: [F32x8; 6]) -> (Self::Boxes, u32);
    /// The groups that may meet box `slot`, and where it starts.
    fn groups(&self, boxes: &Self::Boxes, slot: usize) -> (u32, f32);
    /// The groups that reach as far as `start`.
    fn reach(&self, start: f32) -> u32;
    /// Draws in a group to the `t_max` of its rays; takes effect with [`Cull::settle`].
    fn draw_in<F: Lanes>(&mut self, group: usize, ray: &ScaledRay<F>);
    /// Ends a run of [`Cull::draw_in`].
    fn settle(&mut self);
}

/// The slopes of the groups, one lane each.
pub(super) struct Slopes {
    pub(super) min: [[f32; GROUPS]; 2],
    pub(super) max: [[f32; GROUPS]; 2],
}

impl Slopes {
    pub(super) fn new() -> Self {
        Self { min: [[f32::INFINITY; GROUPS]; 2], max: [[f32::NEG_INFINITY; GROUPS]; 2] }
    }

    pub(super) fn lanes(&self) -> ([F32x16; 2], [F32x16; 2]) {
        let load = |of: &[[f32; GROUPS]; 2]| [F32x16::load(&of[0]), F32x16::load(&of[1])];
        (load(&self.min), load(&self.max))
    }

    pub(super) fn whole(&self) -> ([F32x8; 2], [F32x8; 2]) {
        let (min, max) = self.lanes();
        (
            each(|across| F32x8::splat(min[across].reduce_min())),
            each(|across| F32x8::splat(max[across].reduce_max())),
        )
    }
}

/// Rays that reach farther leave all scenes behind: nobody has to know where they end.
const FAR: f32 = 1e30;

/// Where the ranges of the groups start and end, forwards, widened by the margin.
pub(super) struct Reach {
    pub(super) axes: BeamAxes,
    pub(super) margin: f32,
    pub(super) start: F32x16,
    pub(super) end: F32x16,
    pub(super) ends: [f32; GROUPS],
    pub(super) whole_start: F32x8,
    pub(super) whole_end: F32x8,
}

impl Reach {
    /// Of no rays.
    pub(super) const NOWHERE: Self = Self {
        axes: BeamAxes { main: 0, mirrored: false },
        margin: 0.0,
        start: F32x16::ZERO,
        end: F32x16::ZERO,
        ends: [f32::NEG_INFINITY; GROUPS],
        whole_start: F32x8::ZERO,
        whole_end: F32x8::ZERO,
    };

    /// Takes the rays of other groups.
    pub(super) fn take<F: Lanes>(
        &mut self,
        groups: &[Group<F>; GROUPS],
        live: u32,
        axes: BeamAxes,
        margin: f32,
    ) {
        let inf = f32::INFINITY;
        let mut starts = [inf; GROUPS];
        for index in ones(live) {
            let ray = &groups[index].ray;
            let origin = axes.forward(&ray.origin);
            starts[index] = F::select(ray.valid, origin, F::splat(inf)).reduce_min() - margin;
        }
        self.take_starts(groups, live, axes, margin, &starts);
    }

    /// As [`Reach::take`], if it is known where the first ray of each group starts, less the margin: no
    /// range starts before its origin.
    pub(super) fn take_starts<F: Lanes>(
        &mut self,
        groups: &[Group<F>; GROUPS],
        live: u32,
        axes: BeamAxes,
        margin: f32,
        starts: &[f32; GROUPS],
    ) {
        (self.axes, self.margin) = (axes, margin);
        self.start = F32x16::load(starts);
        self.whole_start = F32x8::splat(self.start.reduce_min());
        self.take_ends(groups, live);
    }

    /// As [`Reach::take`], of rays that all start at `start` on the main axis.
    pub(super) fn take_from<F: Lanes>(
        &mut self,
        groups: &[Group<F>; GROUPS],
        live: u32,
        axes: BeamAxes,
        margin: f32,
        start: f32,
    ) {
        (self.axes, self.margin) = (axes, margin);
        self.start = F32x16::splat(start - margin);
        self.whole_start = F32x8::splat(start - margin);
        self.take_ends(groups, live);
    }

    fn take_ends<F: Lanes>(&mut self, groups: &[Group<F>; GROUPS], live: u32) {
        let mut least = F::splat(f32::MAX);
        for index in ones(live) {
            let ray = &groups[index].ray;
            least = least.min(F::select(ray.valid, ray.t_max, F::splat(f32::MAX)));
        }
        if least.reduce_min() >= FAR {
            self.ends = [f32::INFINITY; GROUPS];
            self.end = F32x16::splat(f32::INFINITY);
            self.whole_end = F32x8::splat(f32::INFINITY);
            return;
        }
        self.ends = [f32::NEG_INFINITY; GROUPS];
        for index in ones(live) {
            self.ends[index] = self.end_of(&groups[index].ray);
        }
        self.settle();
    }

    /// Up to where the rays go on the main axis.
    #[inline(always)]
    fn end_of<F: Lanes>(&self, ray: &ScaledRay<F>) -> f32 {
        let (origin, dir) = (self.axes.forward(&ray.origin), self.axes.forward(&ray.dir));
        let end = ray.t_max.mul_add_fast(dir, origin);
        let end = F::select(ray.t_max.ge(ray.t_min), end, F::splat(f32::NEG_INFINITY));
        end.reduce_max() + self.margin
    }

    #[inline(always)]
    pub(super) fn draw_in<F: Lanes>(&mut self, group: usize, ray: &ScaledRay<F>) {
        self.ends[group] = self.end_of(ray);
    }

    #[inline(always)]
    pub(super) fn settle(&mut self) {
        self.end = F32x16::load(&self.ends);
        self.whole_end = F32x8::splat(self.end.reduce_max());
    }
}
