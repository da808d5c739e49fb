//! The queries: closest hit and any hit, for one ray, eight, and batches of any length.
//!
//! For all of them: the closest hit is the one with the smallest `(t, geom_id, prim_id)`, and a ray
//! is occluded exactly if it has one. The results are the same bits through every query and for
//! every number of threads.

use crate::error::ShapeError;
use rayon::prelude::*;

use crate::hit::{Hit, HitBatch, HitPacket, Hits, NO_HIT};
use crate::pages::Pages;
use crate::ray::{Ray, RayPacket, Rays};
use crate::scene::Scene;
use crate::traverse::sorted::Sorted;
use crate::traverse::{Closest, batch, reference};

/// How many rays a thread takes at a time: many tiles, so that starting a batch costs little.
const CHUNK: usize = 64 * batch::TILE_RAYS;

/// How many neighbours are named together.
const RUN: usize = 16;

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

    /// The closest hit of each ray, on this thread. Rays may come in any order and number;
    /// neighbours that run alike are traced together. Many rays that share about one start or one end
    /// but come in no order are sorted first, which takes 54 bytes a ray; up to 512 MB of them are kept for
    /// the next call.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many hits as rays.
    pub fn intersect_batch(&self, rays: Rays<'_>, mut hits: Hits<'_>) -> Result<(), ShapeError> {
        ShapeError::check("hits", hits.len(), "rays", rays.len())?;
        if let Some(sorted) = Sorted::new(&rays, &self.bvh, false) {
            let found = self.intersect_sorted(&sorted);
            self.give_hits(sorted.give(&found, 0), &mut hits);
        } else {
            self.intersect_in_order(rays, &mut hits);
        }
        Ok(())
    }

    /// As [`Scene::intersect_batch`], on the rayon pool that it is called in.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many hits as rays.
    pub fn par_intersect_batch(&self, rays: Rays<'_>, hits: Hits<'_>) -> Result<(), ShapeError> {
        ShapeError::check("hits", hits.len(), "rays", rays.len())?;
        if let Some(sorted) = Sorted::new(&rays, &self.bvh, true) {
            let found = self.intersect_sorted(&sorted);
            par_chunks(0, hits, &|start, mut hits| {
                self.give_hits(sorted.give(&found, start), &mut hits);
            });
        } else {
            par_chunks(0, hits, &|start, mut hits| {
                self.intersect_in_order(rays.range(start, start + hits.len()), &mut hits);
            });
        }
        Ok(())
    }

    fn intersect_in_order(&self, rays: Rays<'_>, hits: &mut Hits<'_>) {
        batch::intersect(&self.bvh, rays, hits, |ids| self.name(ids));
    }

    /// `t`, `u`, `v` and the id over all geometries.
    fn intersect_sorted(&self, sorted: &Sorted) -> Pages<[u32; 4]> {
        sorted.trace(|rays, places, found: &mut [[u32; 4]]| {
            let mut hits = HitBatch::new(rays.len());
            batch::intersect(&self.bvh, rays, &mut hits.as_hits(), |ids| [*ids; 2]);
            for (index, &place) in places.iter().enumerate() {
                let [t, u, v] = [hits.t[index], hits.u[index], hits.v[index]].map(f32::to_bits);
                found[place as usize] = [t, u, v, hits.prim_id[index]];
            }
        })
    }

    fn give_hits(&self, found: impl Iterator<Item = [u32; 4]>, hits: &mut Hits<'_>) {
        for (index, [t, u, v, id]) in found.take(hits.len()).enumerate() {
            hits.t[index] = f32::from_bits(t);
            hits.u[index] = f32::from_bits(u);
            hits.v[index] = f32::from_bits(v);
            hits.prim_id[index] = id;
        }
        self.name_geometries(hits.prim_id, hits.geom_id);
    }

    /// Whether each ray hits anything, on this thread. Rays come, and may be sorted, as for
    /// [`Scene::intersect_batch`].
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many results as rays.
    pub fn occluded_batch(&self, rays: Rays<'_>, occluded: &mut [bool]) -> Result<(), ShapeError> {
        ShapeError::check("occluded", occluded.len(), "rays", rays.len())?;
        if let Some(sorted) = Sorted::new(&rays, &self.bvh, false) {
            let found = self.occluded_sorted(&sorted);
            give_occluded(sorted.give(&found, 0), occluded);
        } else {
            batch::occluded(&self.bvh, rays, occluded);
        }
        Ok(())
    }

    /// As [`Scene::occluded_batch`], on the rayon pool that it is called in.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many results as rays.
    pub fn par_occluded_batch(
        &self,
        rays: Rays<'_>,
        occluded: &mut [bool],
    ) -> Result<(), ShapeError> {
        ShapeError::check("occluded", occluded.len(), "rays", rays.len())?;
        // One by one: rays that take long lie together, and rayon would hand out a quarter of all at once.
        let chunks = occluded.par_chunks_mut(CHUNK).with_max_len(1).enumerate();
        let chunks = chunks.map(|(chunk, occluded)| (chunk * CHUNK, occluded));
        if let Some(sorted) = Sorted::new(&rays, &self.bvh, true) {
            let found = self.occluded_sorted(&sorted);
            chunks.for_each(|(start, occluded)| {
                give_occluded(sorted.give(&found, start), occluded);
            });
        } else {
            chunks.for_each(|(start, occluded)| {
                batch::occluded(&self.bvh, rays.range(start, start + occluded.len()), occluded);
            });
        }
        Ok(())
    }

    fn occluded_sorted(&self, sorted: &Sorted) -> Pages<u8> {
        sorted.trace(|rays, places, found: &mut [u8]| {
            let mut occluded = vec![false; rays.len()];
            batch::occluded(&self.bvh, rays, &mut occluded);
            for (&place, occluded) in places.iter().zip(occluded) {
                found[place as usize] = u8::from(occluded);
            }
        })
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
    fn name_geometries(&self, prim_ids: &mut [u32], geom_ids: &mut [u32]) {
        for (prim_ids, geom_ids) in prim_ids.chunks_mut(RUN).zip(geom_ids.chunks_mut(RUN)) {
            let mut ids = [NO_HIT; RUN];
            ids[..prim_ids.len()].copy_from_slice(prim_ids);
            let [prims, geometries] = self.name(&ids);
            prim_ids.copy_from_slice(&prims[..prim_ids.len()]);
            geom_ids.copy_from_slice(&geometries[..geom_ids.len()]);
        }
    }

    /// The `prim_id` and `geom_id` of neighbours, by their ids over all geometries. Mostly they hit one
    /// geometry or nothing, which takes no branch for each.
    #[inline(always)]
    fn name<const COUNT: usize>(&self, ids: &[u32; COUNT]) -> [[u32; COUNT]; 2] {
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
        if others == 0 { [prim_ids, geom_ids] } else { self.name_each(ids) }
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

/// Does `work` for each chunk of the hits, which starts at the first argument, on the rayon pool.
fn par_chunks(start: usize, hits: Hits<'_>, work: &(impl Fn(usize, Hits<'_>) + Sync)) {
    if hits.len() <= CHUNK {
        return work(start, hits);
    }
    // Halved at a whole chunk, so that the tiles are those of one thread.
    let middle = (hits.len() / 2).next_multiple_of(CHUNK);
    let (first, second) = hits.split_at(middle);
    rayon::join(|| par_chunks(start, first, work), || par_chunks(start + middle, second, work));
}

fn give_occluded(found: impl Iterator<Item = u8>, occluded: &mut [bool]) {
    for (occluded, found) in occluded.iter_mut().zip(found) {
        *occluded = found != 0;
    }
}
