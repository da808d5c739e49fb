//! A group: sixteen rays, or as many as a query has, and what they have met so far. Boxes are tested with
//! all of them, primitives with those of one register at a time: they have too many values for two.
//!
//! Lanes without a valid ray hold an empty range: they meet no box and no primitive. So do lanes
//! that look for any hit and have one.

use super::corners::Corners;
use super::planes::{Octant, Planes};
use super::single::{Side, Single};
use super::{Closest, SHEAR_ORDER};
use crate::hit::NO_HIT;
use crate::kernels::{
    BeamAxes, Met, Projected, ScaledRay, Sheared, SlabRay, intersect_quad, intersect_sphere,
    intersect_triangle, intersect_triangle_after, may_meet_triangle_after,
};
use crate::simd::{LaneMask, Lanes, each};

/// The most lanes of a group.
pub(super) const MAX_LANES: usize = 16;

/// Rays and what they have met.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Group<F: Lanes> {
    /// The rays; `t_max` is the best hit so far.
    pub(super) ray: ScaledRay<F>,
    /// The shear of each lane along its own main axis, and its origin in the order of that.
    shear: [F; 2],
    inverse: F,
    sheared_origin: [F; 3],
    pub(super) u: F,
    pub(super) v: F,
    /// The bits of the ids of what was met, [`NO_HIT`] where nothing was.
    ids: F,
    /// The valid lanes that run most along each axis.
    along: [u32; 3],
    /// The axes along which there are any, one bit each.
    pub(super) axes: u32,
    /// The valid lanes that have met nothing yet.
    pub(super) missing: u32,
    /// For box tests; made by [`Group::prepare_boxes`].
    slab: SlabRay<F>,
    /// Where the rays run; made likewise.
    pub(super) octant: Octant,
    /// What is before the rays for sure, see [`Sheared::sure_start`]; made by [`Group::prepare_primitives`].
    start: F,
}

impl<F: Lanes> Group<F> {
    pub(super) fn new() -> Self {
        let zero = F::splat(0.0);
        let ray = ScaledRay::new([zero; 3], [zero; 3], zero, zero, F::mask(0));
        Self {
            slab: SlabRay { inverse: [zero; 3], near: [zero; 3], far: [zero; 3] },
            shear: [zero; 2],
            inverse: zero,
            sheared_origin: [zero; 3],
            u: zero,
            v: zero,
            ids: F::splat(f32::from_bits(NO_HIT)),
            along: [0; 3],
            axes: 0,
            missing: 0,
            octant: Octant::SEVERAL,
            start: zero,
            ray,
        }
    }

    /// Takes new rays, which have met nothing.
    #[inline(always)]
    pub(super) fn load(&mut self, ray: &ScaledRay<F>) {
        self.ray = *ray;
        self.along = ray.axis_masks();
        self.axes = 0;
        // Not put together in memory: what it held of the rays before was in the way.
        let zero = F::splat(0.0);
        let (mut shear, mut inverse, mut origin) = ([zero; 2], zero, [zero; 3]);
        for axis in 0..3 {
            if self.along[axis] != 0 {
                self.axes |= 1 << axis;
                let sheared = ray.sheared(axis);
                let mask = F::mask(self.along[axis]);
                shear = each(|place| F::select(mask, sheared.shear[place], shear[place]));
                inverse = F::select(mask, sheared.inverse, inverse);
                origin = each(|place| F::select(mask, sheared.origin[place], origin[place]));
            }
        }
        (self.shear, self.inverse, self.sheared_origin) = (shear, inverse, origin);
        self.u = F::splat(0.0);
        self.v = F::splat(0.0);
        self.ids = F::splat(f32::from_bits(NO_HIT));
        self.missing = ray.valid.bits();
    }

    /// The lanes that have met something.
    #[inline(always)]
    pub(super) fn met(&self) -> u32 {
        self.ray.valid.bits() & !self.missing
    }

    /// How far the rays move across for one step forwards, on the first two of the axes' order.
    #[inline(always)]
    pub(super) fn slopes(&self, axes: BeamAxes) -> [F; 2] {
        let order = axes.order();
        if self.axes == 1 << axes.main {
            // Rays that all run along this axis know it: it is what shears them.
            return if axes.mirrored { self.shear.map(|slope| -slope) } else { self.shear };
        }
        let inverse = F::splat(1.0) / axes.forward(&self.ray.dir);
        [self.ray.dir[order[0]] * inverse, self.ray.dir[order[1]] * inverse]
    }

    /// Makes the rays ready for primitives that are not seen from the origin of all rays.
    #[inline(always)]
    pub(super) fn prepare_primitives(&mut self, extent: f32) {
        for register in 0..F::REGISTERS {
            let start = self.sheared(register).sure_start(extent);
            self.start.set_register(register, start);
        }
    }

    /// Makes the rays ready for [`Group::interval`].
    #[inline(always)]
    pub(super) fn prepare_boxes(&mut self, extent: f32) {
        self.slab = SlabRay::new(&self.ray, extent);
        let valid = self.ray.valid.bits();
        let negative: [u32; 3] =
            each(|axis| self.slab.inverse[axis].lt(F::splat(0.0)).bits() & valid);
        self.octant = Octant::of(negative, valid);
    }

    /// True if every valid lane has met something, or none is valid.
    #[inline(always)]
    pub(super) fn is_dead(&self) -> bool {
        self.missing == 0
    }

    /// Where each ray is inside the box; empty (the first value is larger) where it misses.
    #[inline(always)]
    pub(super) fn interval(&self, planes: &Planes<F>) -> (F, F) {
        let (near, far) = (planes.near, planes.far);
        if self.octant == planes.octant {
            self.slab.interval(near, far, self.ray.t_min, self.ray.t_max)
        } else {
            self.slab.interval_any_sign(near, far, self.ray.t_min, self.ray.t_max)
        }
    }

    /// The rays of one register, each in the order of its own main axis.
    #[inline(always)]
    fn sheared(&self, register: usize) -> Sheared<F::Register> {
        Sheared {
            origin: each(|place| self.sheared_origin[place].register(register)),
            shear: each(|place| self.shear[place].register(register)),
            inverse: self.inverse.register(register),
            t_min: self.ray.t_min.register(register),
            t_max: self.ray.t_max.register(register),
        }
    }

    /// The directions of one register.
    #[inline(always)]
    pub(super) fn dir(&self, register: usize) -> [F::Register; 3] {
        each(|axis| self.ray.dir[axis].register(register))
    }

    /// Tests a triangle, which may already be relative to the origin that all rays share, with the rays of
    /// one register. True if it is kept for any lane.
    ///
    /// What rays start on is left out early if `AFTER`: the rays must have been made ready for that.
    #[inline(always)]
    pub(super) fn meet_triangle<const ANY: bool, const AFTER: bool>(
        &mut self,
        register: usize,
        corners: &Corners<F::Register, 3>,
        from_origin: bool,
        id: u32,
    ) -> bool {
        let start = self.start.register(register);
        self.meet_points::<ANY, 3>(register, corners, from_origin, id, |ray, corners, active| {
            if AFTER {
                intersect_triangle_after(ray, corners, start, active)
            } else {
                intersect_triangle(ray, corners, active)
            }
        })
    }

    /// False if [`Group::meet_triangle`] would keep nothing, whatever its rays have met; told without a
    /// branch. The rays must have been made ready for primitives.
    #[inline(always)]
    pub(super) fn may_meet_triangle(
        &self,
        register: usize,
        corners: &Corners<F::Register, 3>,
    ) -> bool {
        let ray = self.sheared(register);
        let corners = self.projected(register, &ray, corners, false);
        let valid = F::mask_register(self.ray.valid, register);
        may_meet_triangle_after(&ray, &corners, self.start.register(register), valid).any()
    }

    /// Tests a quad, its corners in order around it, likewise. True if it is kept for any lane.
    #[inline(always)]
    pub(super) fn meet_quad<const ANY: bool>(
        &mut self,
        register: usize,
        corners: &Corners<F::Register, 4>,
        from_origin: bool,
        id: u32,
    ) -> bool {
        self.meet_points::<ANY, 4>(register, corners, from_origin, id, |ray, corners, active| {
            intersect_quad(ray, corners, active)
        })
    }

    /// Tests a primitive of so many corners with the rays of one register, whatever their main axes are.
    #[inline(always)]
    fn meet_points<const ANY: bool, const POINTS: usize>(
        &mut self,
        register: usize,
        corners: &Corners<F::Register, POINTS>,
        from_origin: bool,
        id: u32,
        test: impl Fn(
            &Sheared<F::Register>,
            [Projected<F::Register>; POINTS],
            <F::Register as Lanes>::Mask,
        ) -> Option<Met<F::Register>>,
    ) -> bool {
        let ray = self.sheared(register);
        let corners = self.projected(register, &ray, corners, from_origin);
        let met = test(&ray, corners, self.wanted::<ANY>(register));
        met.is_some_and(|met| self.keep::<ANY>(register, &met, id))
    }

    /// The corners of a primitive as the rays of one register see them, whatever their main axes are.
    #[inline(always)]
    fn projected<const POINTS: usize>(
        &self,
        register: usize,
        ray: &Sheared<F::Register>,
        corners: &Corners<F::Register, POINTS>,
        from_origin: bool,
    ) -> [Projected<F::Register>; POINTS] {
        // One test for both, and for rays along several axes: cheaper than one for each axis.
        let points = if self.axes == corners.axis() {
            corners.straight()
        } else {
            corners.turned(&each(|axis| self.along[axis] >> first_lane::<F>(register)))
        };
        each(|corner| {
            if from_origin {
                ray.project_from_origin(points[corner])
            } else {
                ray.project(points[corner])
            }
        })
    }

    /// Tests a sphere, centre and radius, with the rays of one register. True if it is kept for any lane.
    #[inline(always)]
    pub(super) fn meet_sphere<const ANY: bool>(
        &mut self,
        register: usize,
        sphere: &[f32; 4],
        id: u32,
    ) -> bool {
        let [x, y, z, radius] = sphere.map(Lanes::splat);
        let ray = self.ray.register(register);
        intersect_sphere(&ray, [x, y, z], radius, self.wanted::<ANY>(register))
            .is_some_and(|met| self.keep::<ANY>(register, &met, id))
    }

    /// The lanes of one register that are still to be tested.
    #[inline(always)]
    fn wanted<const ANY: bool>(&self, register: usize) -> <F::Register as Lanes>::Mask {
        if ANY {
            F::Register::mask(self.missing >> first_lane::<F>(register))
        } else {
            F::mask_register(self.ray.valid, register)
        }
    }

    /// Keeps the lanes of `met` that are closer than what they have.
    #[inline(always)]
    fn keep<const ANY: bool>(&mut self, register: usize, met: &Met<F::Register>, id: u32) -> bool {
        let first = first_lane::<F>(register);
        let mut closer = met.mask;
        if ANY {
            set::<F>(&mut self.ray.t_max, register, closer, F::Register::splat(f32::NEG_INFINITY));
        } else {
            // No hit is beyond `t_max`: those that are not closer are at it.
            let mut tied = (met.mask & met.t.eq(self.ray.t_max.register(register))).bits();
            if tied != 0 {
                for lane in 0..F::Register::LANES {
                    if tied >> lane & 1 != 0 && id < self.id(first + lane) {
                        tied &= !(1 << lane);
                    }
                }
                closer = closer & !F::Register::mask(tied);
                if !closer.any() {
                    return false;
                }
            }
            set::<F>(&mut self.ray.t_max, register, closer, met.t);
            set::<F>(&mut self.u, register, closer, met.u);
            set::<F>(&mut self.v, register, closer, met.v);
        }
        self.missing &= !(closer.bits() << first);
        set::<F>(&mut self.ids, register, closer, F::Register::splat(f32::from_bits(id)));
        true
    }

    /// The ray of a valid lane; the boxes must be prepared.
    #[inline(always)]
    pub(super) fn take_single(&self, lane: usize, to: &mut Single) {
        for axis in 0..3 {
            to.origin[axis] = self.ray.origin[axis].lane(lane);
            to.dir[axis] = self.ray.dir[axis].lane(lane);
            to.inverse[axis] = self.slab.inverse[axis].lane(lane);
            to.near[axis] = self.slab.near[axis].lane(lane);
            to.far[axis] = self.slab.far[axis].lane(lane);
            (to.near_side[axis], to.far_side[axis]) = if to.inverse[axis] < 0.0 {
                (Side::Upper, Side::Lower)
            } else {
                (Side::Lower, Side::Upper)
            };
        }
        to.t_min = self.ray.t_min.lane(lane);
        to.shear = [self.shear[0].lane(lane), self.shear[1].lane(lane)];
        to.inverse_main = self.inverse.lane(lane);
        let (x, y) = (self.along[0] >> lane & 1, self.along[1] >> lane & 1);
        let main = 2 - 2 * x - y;
        for (place, axis) in SHEAR_ORDER[main as usize & 3].into_iter().enumerate() {
            to.order[place] = axis as u32;
            to.sheared_origin[place] = self.sheared_origin[place].lane(lane);
        }
    }

    /// The ids of what the first lanes met, [`NO_HIT`] where nothing was.
    #[inline(always)]
    pub(super) fn ids<const COUNT: usize>(&self) -> [u32; COUNT] {
        each(|lane| self.id(lane))
    }

    /// The id of what a lane met, or [`NO_HIT`].
    #[inline(always)]
    pub(super) fn id(&self, lane: usize) -> u32 {
        self.ids.lane(lane).to_bits()
    }

    /// What a lane met, or [`NO_HIT`], `t` in terms of the scaled ray.
    #[inline(always)]
    pub(super) fn best(&self, lane: usize) -> Closest {
        let t = self.ray.t_max.lane(lane);
        Closest { t, u: self.u.lane(lane), v: self.v.lane(lane), id: self.id(lane) }
    }

    /// Notes what a lane met, likewise.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, best: &Closest) {
        self.missing &= !(u32::from(best.id != NO_HIT) << lane);
        self.ids.set_lane(lane, f32::from_bits(best.id));
        self.ray.t_max.set_lane(lane, best.t);
        self.u.set_lane(lane, best.u);
        self.v.set_lane(lane, best.v);
    }

    /// `t` of the caller's rays, infinite where nothing was met.
    #[inline(always)]
    pub(super) fn t(&self) -> F {
        // Valid lanes that met nothing may still be missing, invalid ones always are.
        F::select(F::mask(self.met()), self.ray.t_max * self.ray.scale, F::splat(f32::INFINITY))
    }

    /// The closest hit of a lane, in terms of the caller's ray; `None` if it met nothing.
    pub(super) fn closest(&self, lane: usize) -> Option<Closest> {
        let best = self.best(lane);
        (best.id != NO_HIT).then(|| Closest { t: best.t * self.ray.scale.lane(lane), ..best })
    }
}

/// The first lane of a register.
#[inline(always)]
fn first_lane<F: Lanes>(register: usize) -> usize {
    register * F::Register::LANES
}

/// Writes `value` to the lanes of one register that are in `mask`.
#[inline(always)]
fn set<F: Lanes>(
    lanes: &mut F,
    register: usize,
    mask: <F::Register as Lanes>::Mask,
    value: F::Register,
) {
    let mut own = lanes.register(register);
    own.set(mask, value);
    lanes.set_register(register, own);
}
