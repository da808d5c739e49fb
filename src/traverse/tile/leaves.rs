//! A tile at a leaf: its primitives, each with the groups whose bounds meet the primitive's box.

use super::Tile;
use crate::bvh::{Bvh, Child, LeafArray, PrimKind};
use crate::simd::{F32x8, Lanes, each};
use crate::traverse::corners::Corners;
use crate::traverse::cull::Cull;
use crate::traverse::group::Group;
use crate::traverse::leaf::{Leaf, SPHERE_FIELDS, boxes};
use crate::traverse::visits::count;
use crate::traverse::{ones, pace};

impl<F: Lanes> Tile<F> {
    /// Tests a leaf of that description with these groups.
    #[inline(always)]
    pub(super) fn enter_child<const ANY: bool, const APART: bool, C: Cull>(
        &mut self,
        bvh: &Bvh,
        cull: &mut C,
        groups: u32,
        (index, meta): (u32, u32),
    ) {
        let leaves = &bvh.leaves;
        let Child::Leaf { kind, first, count } = Child::unpack(index, meta) else {
            return;
        };
        let leaf = (first, count);
        match kind {
            PrimKind::Triangle => self.enter_leaf::<ANY, C, 9, Corners<F, 3>>(
                cull,
                groups,
                (&leaves.triangles, leaf),
                |main, field| Corners::new(main, field),
                |group, corners, id| group.meet_triangle::<ANY, APART>(corners, C::FAN, id),
            ),
            PrimKind::Quad => self.enter_leaf::<ANY, C, 12, Corners<F, 4>>(
                cull,
                groups,
                (&leaves.quads, leaf),
                |main, field| Corners::new(main, field),
                |group, corners, id| group.meet_quad::<ANY>(corners, C::FAN, id),
            ),
            PrimKind::Sphere => self.enter_leaf::<ANY, C, 4, [f32; 4]>(
                cull,
                groups,
                (&leaves.spheres, leaf),
                |_, field| each(field),
                |group, sphere, id| group.meet_sphere::<ANY>(sphere, id),
            ),
        }
    }

    /// Tests the primitives of a leaf: `ready` takes one out, given the axis along which most rays run and
    /// its fields, and `meet` tests it with a group.
    #[inline(always)]
    fn enter_leaf<const ANY: bool, C: Cull, const FIELDS: usize, P>(
        &mut self,
        cull: &mut C,
        groups: u32,
        (array, (first, len)): (&LeafArray<FIELDS>, (u32, u32)),
        ready: impl Fn(usize, &dyn Fn(usize) -> f32) -> P,
        meet: impl Fn(&mut Group<F>, &P, u32) -> bool,
    ) {
        count(|visits| visits.leaves += 1);
        self.spend(pace::LEAF);
        let packed = array.leaf(first, len);
        let (boxes, places) = cull.boxes(boxes::<FIELDS>(|field| F32x8::load(packed.lanes(field))));
        let leaf: Leaf<FIELDS> = if C::FAN && FIELDS != SPHERE_FIELDS {
            Leaf::seen_from(cull.origin(), packed)
        } else {
            Leaf::new(packed)
        };
        let outlines = if C::FAN { leaf.outlines() } else { None };
        let ids = &array.ids[first as usize..][..len as usize];
        let mut places = places & ((1 << len) - 1);
        let mut closer = 0;
        while places != 0 {
            let place = places.trailing_zeros();
            places &= places - 1;
            let mut met = cull.groups(&boxes, place as usize).0 & groups & self.live;
            if met == 0 {
                continue;
            }
            count(|visits| visits.primitives += 1);
            self.spend(pace::PRIMITIVE * met.count_ones());
            if let Some(outlines) = &outlines {
                let inside = |index: usize| {
                    outlines.may_meet(place as usize, &self.groups[index & 15].ray.dir)
                };
                met = ones(met).fold(0, |met, index| met | u32::from(inside(index)) << index);
            }
            let primitive = ready(self.main, &|field| leaf.field(place as usize, field));
            let id = ids[place as usize];
            for index in ones(met) {
                count(|visits| visits.primitive_groups += 1);
                let group = &mut self.groups[index];
                if meet(group, &primitive, id) {
                    count(|visits| visits.met_groups += 1);
                    closer |= 1 << index;
                    if ANY && group.is_dead() {
                        self.live &= !(1 << index);
                    }
                }
            }
        }
        // As long as a ray has met nothing, its group reaches as far as before.
        let mut drawn_in = false;
        for index in ones(closer & self.live).filter(|&index| self.groups[index].missing == 0) {
            cull.draw_in(index, &self.groups[index].ray);
            drawn_in = true;
        }
        if drawn_in {
            cull.settle();
        }
    }
}
