//! Sixteen shadow rays side by side, and which of them have met something.
//!
//! A lane that has met something, or has no valid ray, holds an empty range: it meets no box and no
//! primitive any more.

use crate::bvh::Node;
use crate::kernels::{
    Projected, ScaledRay, Sheared, SlabRay, intersect_quad, intersect_triangle, occluded_by_sphere,
};
use crate::points::SHADOW_T_MAX;
use crate::simd::{F32x16, LaneMask, Lanes};

/// The order of axes in which each axis comes last.
/// There is no fourth.
const ORDER: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];

/// One register of shadow rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bundle {
    ray: ScaledRay<F32x16>,
    /// The shear of each lane along its own main axis.
    shear: [F32x16; 2],
    inverse: F32x16,
    slab: SlabRay<F32x16>,
    /// Where a plane that is met first lies in a node's bounds, if that is the same in all lanes.
    near_plane: Option<[usize; 3]>,
    /// The lanes that are to be tested along each main axis.
    along: [u32; 3],
    /// The axes along which there are any, one bit each.
    axes: u32,
    seen: u32,
}

impl Bundle {
    /// The rays from `origin` along `dir`, the lanes in `active`, in a scene of this extent.
    #[inline(always)]
    pub(super) fn new(origin: [F32x16; 3], dir: [F32x16; 3], active: u32, extent: f32) -> Self {
        let zero = F32x16::splat(0.0);
        let t_max = F32x16::splat(SHADOW_T_MAX);
        let ray = ScaledRay::new(origin, dir, zero, t_max, F32x16::mask(active));
        let along = ray.axis_masks();
        let (mut shear, mut inverse, mut axes) = ([zero; 2], zero, 0);
        for (axis, &lanes) in along.iter().enumerate() {
            if lanes != 0 {
                axes |= 1 << axis;
                let (sheared, mask) = (ray.sheared(axis), F32x16::mask(lanes));
                shear[0] = Lanes::select(mask, sheared.shear[0], shear[0]);
                shear[1] = Lanes::select(mask, sheared.shear[1], shear[1]);
                inverse = Lanes::select(mask, sheared.inverse, inverse);
            }
        }
        let slab = SlabRay::new(&ray, extent);
        let valid = ray.valid.bits();
        let negative = slab.inverse.map(|part| Lanes::lt(part, zero).bits() & valid);
        let one_sign = negative.iter().all(|&lanes| lanes == 0 || lanes == valid);
        let near_plane = one_sign
            .then(|| std::array::from_fn(|axis| if negative[axis] == 0 { axis } else { axis + 3 }));
        Self { ray, shear, inverse, slab, near_plane, along, axes, seen: active }
    }

    /// The lanes that have met nothing so far.
    #[inline(always)]
    pub(super) fn seen(&self) -> u32 {
        self.seen
    }

    /// Those among them that still may: invalid rays meet nothing.
    #[inline(always)]
    pub(super) fn live(&self) -> u32 {
        self.along[0] | self.along[1] | self.along[2]
    }

    /// The valid rays' origins and directions: the smallest and the largest of what `of` makes of
    /// them.
    #[inline(always)]
    pub(super) fn range<const N: usize>(
        &self,
        of: impl Fn(&ScaledRay<F32x16>) -> [F32x16; N],
    ) -> [[f32; N]; 2] {
        let values = of(&self.ray);
        let among = |other: f32| {
            values.map(|lanes| Lanes::select(self.ray.valid, lanes, F32x16::splat(other)))
        };
        [
            among(f32::INFINITY).map(|lanes| lanes.reduce_min()),
            among(f32::NEG_INFINITY).map(|lanes| lanes.reduce_max()),
        ]
    }

    /// True if a ray meets the box in slot `slot`.
    #[inline(always)]
    pub(super) fn meets_box(&self, node: &Node, slot: usize) -> bool {
        let plane = |place: usize| F32x16::splat(node.bounds[place][slot]);
        let (t_min, t_max) = (self.ray.t_min, self.ray.t_max);
        let (near, far) = match self.near_plane {
            Some(near) => {
                let far = |axis: usize| plane(2 * axis + 3 - near[axis]);
                let near = [plane(near[0]), plane(near[1]), plane(near[2])];
                self.slab.interval(near, [far(0), far(1), far(2)], t_min, t_max)
            }
            None => self.slab.interval_any_sign(
                [plane(0), plane(1), plane(2)],
                [plane(3), plane(4), plane(5)],
                t_min,
                t_max,
            ),
        };
        Lanes::le(near, far).any()
    }

    /// Tests a triangle, `v0.x .. v2.z`. True if a ray meets it.
    #[inline(never)]
    pub(super) fn triangle(&mut self, fields: &[f32; 9]) -> bool {
        self.along_axes(fields, |ray, corners, active| {
            intersect_triangle(ray, corners, active).map_or(0, |met| met.mask.bits())
        })
    }

    /// Tests a quad, its corners in order around it. True if a ray meets it.
    #[inline(never)]
    pub(super) fn quad(&mut self, fields: &[f32; 12]) -> bool {
        self.along_axes(fields, |ray, corners, active| {
            intersect_quad(ray, corners, active).map_or(0, |met| met.mask.bits())
        })
    }

    /// Tests a primitive with the lanes of each main axis in turn; mostly there is just one.
    #[inline(always)]
    fn along_axes<const FIELDS: usize, const CORNERS: usize>(
        &mut self,
        fields: &[f32; FIELDS],
        test: impl Fn(&Sheared<F32x16>, [Projected<F32x16>; CORNERS], <F32x16 as Lanes>::Mask) -> u32,
    ) -> bool {
        let mut hit = 0;
        let mut axes = self.axes;
        while axes != 0 {
            let main = axes.trailing_zeros() as usize;
            axes &= axes - 1;
            let order = ORDER[main & 3];
            let ray = Sheared {
                origin: [
                    self.ray.origin[order[0]],
                    self.ray.origin[order[1]],
                    self.ray.origin[order[2]],
                ],
                shear: self.shear,
                inverse: self.inverse,
                t_min: self.ray.t_min,
                t_max: self.ray.t_max,
            };
            let corners = std::array::from_fn(|corner| {
                // Spelt out: a `map` over `order` is not always inlined, and then costs twice what
                // the test does.
                let part = |axis: usize| F32x16::splat(fields[3 * corner + axis]);
                ray.project([part(order[0]), part(order[1]), part(order[2])])
            });
            hit |= test(&ray, corners, F32x16::mask(self.along[main]));
        }
        self.settle(hit)
    }

    /// Tests a sphere, centre and radius. True if a ray meets it.
    #[inline(never)]
    pub(super) fn sphere(&mut self, fields: &[f32; 4]) -> bool {
        let [x, y, z, radius] = *fields;
        let hit = occluded_by_sphere(&self.ray, [x, y, z], radius, F32x16::mask(self.live()));
        self.settle(hit)
    }

    #[inline(always)]
    fn settle(&mut self, hit: u32) -> bool {
        if hit != 0 {
            self.seen &= !hit;
            self.along = self.along.map(|lanes| lanes & !hit);
            let met = F32x16::mask(hit);
            self.ray.t_max = Lanes::select(met, F32x16::splat(f32::NEG_INFINITY), self.ray.t_max);
        }
        hit != 0
    }
}
