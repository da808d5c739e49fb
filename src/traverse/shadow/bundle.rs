//! Sixteen shadow rays side by side, and which of them have met something.
//!
//! A lane that has met something, or has no valid ray, holds an empty range: it meets no box and no
//! primitive any more.

use super::leaf::Leaf;
use crate::bvh::Node;
use crate::kernels::{
    BeamAxes, Projected, ScaledRay, Sheared, SlabRay, intersect_quad, intersect_triangle,
    occluded_by_sphere,
};
use crate::points::SHADOW_T_MAX;
use crate::simd::{F32x8, F32x16, LaneMask, Lanes, each};
use crate::traverse::{SHEAR_ORDER, ones};

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
    /// No rays.
    pub(super) fn empty() -> Self {
        let zero = F32x16::splat(0.0);
        let ray = ScaledRay::new([zero; 3], [zero; 3], zero, zero, F32x16::mask(0));
        Self {
            slab: SlabRay::new(&ray, 0.0),
            ray,
            shear: [zero; 2],
            inverse: zero,
            near_plane: None,
            along: [0; 3],
            axes: 0,
            seen: 0,
        }
    }

    /// Takes the rays from `origin` along `dir`, the lanes in `active`, in a scene of this extent.
    #[inline(always)]
    pub(super) fn load(&mut self, origin: [F32x16; 3], dir: [F32x16; 3], active: u32, extent: f32) {
        let zero = F32x16::splat(0.0);
        let t_max = F32x16::splat(SHADOW_T_MAX);
        // In place: copies of so many registers go through memory.
        self.ray = ScaledRay::new(origin, dir, zero, t_max, F32x16::mask(active));
        let ray = &self.ray;
        self.slab = SlabRay::new(ray, extent);
        self.along = ray.axis_masks();
        self.axes = 0;
        for (axis, &[x, y, _]) in SHEAR_ORDER.iter().take(3).enumerate() {
            if self.along[axis] != 0 {
                self.axes |= 1 << axis;
                let mask = F32x16::mask(self.along[axis]);
                // That of the largest part is the quotient of the shear, bit for bit.
                let inverse = self.slab.inverse[axis];
                self.shear[0].set(mask, ray.dir[x] * inverse);
                self.shear[1].set(mask, ray.dir[y] * inverse);
                self.inverse.set(mask, inverse);
            }
        }
        let valid = ray.valid.bits();
        let negative = |axis: usize| Lanes::lt(self.slab.inverse[axis], zero).bits() & valid;
        let negative = [negative(0), negative(1), negative(2)];
        let one_sign = |lanes: u32| lanes == 0 || lanes == valid;
        let near = |axis: usize| if negative[axis] == 0 { axis } else { axis + 3 };
        self.near_plane = (one_sign(negative[0]) && one_sign(negative[1]) && one_sign(negative[2]))
            .then(|| [near(0), near(1), near(2)]);
        self.seen = active;
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

    /// Where the valid rays start, the smallest and the largest coordinates in these axes.
    #[inline(always)]
    pub(super) fn origins(&self, axes: BeamAxes) -> [[f32; 3]; 2] {
        self.range(axes.turn(self.ray.origin))
    }

    /// The smallest and the largest slopes of the valid rays.
    #[inline(always)]
    pub(super) fn slopes(&self, axes: BeamAxes) -> [[f32; 2]; 2] {
        let [a, b, _] = axes.turn(self.ray.dir);
        // The slab test's quotient: rays that run along an axis have no part near zero there.
        let inverse = axes.forward(&self.slab.inverse);
        self.range([a * inverse, b * inverse])
    }

    /// The smallest and the largest of what the valid rays have.
    #[inline(always)]
    fn range<const N: usize>(&self, of: [F32x16; N]) -> [[f32; N]; 2] {
        let (inf, neg) = (F32x16::splat(f32::INFINITY), F32x16::splat(f32::NEG_INFINITY));
        let mut range = [[0.0; N]; 2];
        // Loops, since a `map` is not always inlined.
        for (place, lanes) in of.into_iter().enumerate() {
            range[0][place] = Lanes::select(self.ray.valid, lanes, inf).reduce_min();
            range[1][place] = Lanes::select(self.ray.valid, lanes, neg).reduce_max();
        }
        range
    }

    /// The lanes whose rays meet the box in slot `slot`.
    #[inline(always)]
    pub(super) fn lanes_in_box(&self, node: &Node, slot: usize) -> u32 {
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
        Lanes::le(near, far).bits()
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
            let order = SHEAR_ORDER[main & 3];
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
        let part = |field: usize| F32x16::splat(fields[field]);
        let center = [part(0), part(1), part(2)];
        let hit = occluded_by_sphere(&self.ray, center, part(3), F32x16::mask(self.live()));
        self.settle(hit)
    }

    /// Tests a whole leaf with the rays of `lanes`, one by one. True if a ray meets something.
    #[inline(never)]
    pub(super) fn singly<const FIELDS: usize>(
        &mut self,
        lanes: u32,
        leaf: &Leaf<'_, FIELDS>,
    ) -> bool {
        let active = F32x8::mask((1 << leaf.count) - 1);
        let fields: [F32x8; FIELDS] = each(|field| leaf.lanes(field));
        let mut hit = 0;
        for lane in ones(lanes) {
            let of = |lanes: F32x16| F32x8::splat(lanes.lane(lane));
            let met = if FIELDS == 4 {
                let ray = ScaledRay {
                    origin: self.ray.origin.map(of),
                    dir: self.ray.dir.map(of),
                    t_min: of(self.ray.t_min),
                    t_max: of(self.ray.t_max),
                    scale: of(self.ray.scale),
                    valid: active,
                };
                let center = [fields[0], fields[1], fields[2]];
                occluded_by_sphere(&ray, center, fields[3], active) != 0
            } else {
                let main = (0..2).find(|&main| self.along[main] >> lane & 1 != 0).unwrap_or(2);
                let order = SHEAR_ORDER[main];
                let ray = Sheared {
                    origin: [
                        of(self.ray.origin[order[0]]),
                        of(self.ray.origin[order[1]]),
                        of(self.ray.origin[order[2]]),
                    ],
                    shear: [of(self.shear[0]), of(self.shear[1])],
                    inverse: of(self.inverse),
                    t_min: of(self.ray.t_min),
                    t_max: of(self.ray.t_max),
                };
                let corner = |corner: usize| {
                    let part = |axis: usize| fields[(3 * corner + axis) % FIELDS];
                    ray.project([part(order[0]), part(order[1]), part(order[2])])
                };
                let (a, b, c) = (corner(0), corner(1), corner(2));
                if FIELDS == 9 {
                    intersect_triangle(&ray, [a, b, c], active).is_some()
                } else {
                    intersect_quad(&ray, [a, b, c, corner(3)], active).is_some()
                }
            };
            hit |= u32::from(met) << lane;
        }
        self.settle(hit)
    }

    #[inline(always)]
    fn settle(&mut self, hit: u32) -> bool {
        if hit != 0 {
            self.seen &= !hit;
            self.along = self.along.map(|lanes| lanes & !hit);
            let met = F32x16::mask(hit);
            self.ray.t_max.set(met, F32x16::splat(f32::NEG_INFINITY));
        }
        hit != 0
    }
}
