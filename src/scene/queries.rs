//! The queries for one ray and eight, closest hit and any hit, and what all queries name hits by. Those for
//! batches are in `batches`.
//!
//! For all of them: the closest hit is the one with the smallest `(t, geom_id, prim_id)`, and a ray
//! is occluded exactly if it has one. The results are the same bits through every query and for
//! every number of threads.

use crate::hit::{Hit, HitPacket, NO_HIT};
use crate::ray::{Ray, RayPacket};
use crate::scene::Scene;
use crate::traverse::{Closest, batch, reference};

/// How many neighbours are named together.
const RUN: usize = 16;

/// The most geometries beyond the first one among which neighbours are named together.
const MOST_NAMED: usize = 6;

impl Scene {
    /// The closest hit of one ray.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        batch::intersect_one(&self.bvh, ray).map(|closest| self.hit(&closest))
    }

    /// True if the ray hits anything.
    pub fn occluded(&self, ray: &Ray) -> bool {
        batch::occluded_one(&self.bvh, ray)
    }

    /// The closest hits of the lanes of `rays` whose bit in `active` is set. The other lanes of
    /// `hits` keep their bytes.
    pub fn intersect_packet(&self, rays: &RayPacket, active: u8, hits: &mut HitPacket) {
        let mut hits = hits.as_hits();
        batch::intersect_packet(&self.bvh, rays, active, |lane, best| {
            hits.set(lane, &self.hit_or_miss(best));
        });
    }

    /// One bit for each lane whose bit in `active` is set: 1 if its ray hits anything. The bits of
    /// the other lanes are 0.
    pub fn occluded_packet(&self, rays: &RayPacket, active: u8) -> u8 {
        batch::occluded_packet(&self.bvh, rays, active)
    }

    /// The closest hit of one ray by the scalar reference: a loop over all primitives.
    pub fn intersect_reference(&self, ray: &Ray) -> Option<Hit> {
        let kinds = self.first_ids.iter().zip(&self.geometries).flat_map(|(&first, geometry)| {
            (first..first + geometry.count).map(move |id| (id, geometry.kind))
        });
        reference::intersect(&self.bvh.leaves, kinds, ray).map(|closest| self.hit(&closest))
    }

    fn hit_or_miss(&self, closest: Option<Closest>) -> Hit {
        closest.map_or(Hit::MISS, |closest| self.hit(&closest))
    }

    /// Turns the ids over all geometries that a batch found into `prim_id` and `geom_id`.
    pub(super) fn name_geometries(&self, prim_ids: &mut [u32], geom_ids: &mut [u32]) {
        let (prim_runs, prim_ids) = prim_ids.as_chunks_mut::<RUN>();
        let (geom_runs, geom_ids) = geom_ids.as_chunks_mut();
        for (prim_ids, geom_ids) in prim_runs.iter_mut().zip(geom_runs) {
            [*prim_ids, *geom_ids] = self.name(prim_ids);
        }
        if !prim_ids.is_empty() {
            let mut ids = [NO_HIT; RUN];
            ids[..prim_ids.len()].copy_from_slice(prim_ids);
            let [prims, geometries] = self.name(&ids);
            prim_ids.copy_from_slice(&prims[..prim_ids.len()]);
            geom_ids.copy_from_slice(&geometries[..geom_ids.len()]);
        }
    }

    /// The `prim_id` and `geom_id` of neighbours, by their ids over all geometries. Mostly they hit one
    /// geometry, a few or nothing, which takes no branch for each.
    #[inline(always)]
    pub(super) fn name<const COUNT: usize>(&self, ids: &[u32; COUNT]) -> [[u32; COUNT]; 2] {
        let least = ids.iter().fold(NO_HIT, |least, &id| least.min(id));
        if least == NO_HIT {
            return [[NO_HIT; COUNT]; 2];
        }
        let geometry = self.geometry_of(least);
        let first = self.first_ids[geometry];
        let next = self.first_ids.get(geometry + 1).copied().unwrap_or(NO_HIT);
        let (mut prim_ids, mut geom_ids, mut others) = ([0; COUNT], [0; COUNT], 0);
        for (lane, &id) in ids.iter().enumerate() {
            let within = id < next;
            others |= u32::from(!within & (id != NO_HIT));
            prim_ids[lane] = if within { id - first } else { NO_HIT };
            geom_ids[lane] = if within { geometry as u32 } else { NO_HIT };
        }
        if others == 0 { [prim_ids, geom_ids] } else { self.name_several(ids, geometry) }
    }

    /// As [`Scene::name`], of hits from geometry `low` on.
    #[inline(never)]
    fn name_several<const COUNT: usize>(
        &self,
        ids: &[u32; COUNT],
        low: usize,
    ) -> [[u32; COUNT]; 2] {
        // Nothing comes after all: one more is zero.
        let most = ids.iter().fold(0, |most, &id| most.max(id.wrapping_add(1))) - 1;
        let high = self.geometry_of(most);
        if high - low > MOST_NAMED {
            return self.name_each(ids);
        }
        let (mut firsts, mut geom_ids) = ([self.first_ids[low]; COUNT], [low as u32; COUNT]);
        for &first in &self.first_ids[low + 1..=high] {
            for lane in 0..COUNT {
                let beyond = ids[lane] >= first;
                firsts[lane] = if beyond { first } else { firsts[lane] };
                geom_ids[lane] += u32::from(beyond);
            }
        }
        let mut prim_ids = [NO_HIT; COUNT];
        for lane in 0..COUNT {
            let hit = ids[lane] != NO_HIT;
            prim_ids[lane] = if hit { ids[lane] - firsts[lane] } else { NO_HIT };
            geom_ids[lane] = if hit { geom_ids[lane] } else { NO_HIT };
        }
        [prim_ids, geom_ids]
    }

    /// As [`Scene::name`], one by one.
    #[cold]
    #[inline(never)]
    fn name_each<const COUNT: usize>(&self, ids: &[u32; COUNT]) -> [[u32; COUNT]; 2] {
        let mut named = [[NO_HIT; COUNT]; 2];
        for (lane, &id) in ids.iter().enumerate().filter(|&(_, &id)| id != NO_HIT) {
            let geometry = self.geometry_of(id);
            (named[0][lane], named[1][lane]) = (id - self.first_ids[geometry], geometry as u32);
        }
        named
    }

    /// The geometry that a primitive belongs to.
    #[inline(always)]
    fn geometry_of(&self, id: u32) -> usize {
        self.first_ids.partition_point(|&first| first <= id) - 1
    }

    /// The hit that a traversal found, its primitive by geometry.
    fn hit(&self, closest: &Closest) -> Hit {
        let geom_id = self.geometry_of(closest.id);
        let prim_id = closest.id - self.first_ids[geom_id];
        Hit { t: closest.t, u: closest.u, v: closest.v, prim_id, geom_id: geom_id as u32 }
    }
}
