//! The queries: closest hit and any hit, for one ray, eight, and batches of any length.
//!
//! For all of them: the closest hit is the one with the smallest `(t, geom_id, prim_id)`, and a ray
//! is occluded exactly if it has one. The results are the same bits through every query and for
//! every number of threads.

use crate::error::ShapeError;
use rayon::prelude::*;

use crate::hit::{Hit, HitPacket, Hits, NO_HIT};
use crate::ray::{Ray, RayPacket, Rays};
use crate::scene::Scene;
use crate::traverse::{Closest, batch, reference};

/// How many rays a thread takes at a time: many tiles, so that starting a batch costs little.
const CHUNK: usize = 64 * batch::TILE_RAYS;

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
    /// neighbours that run alike are traced together.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many hits as rays.
    pub fn intersect_batch(&self, rays: Rays<'_>, mut hits: Hits<'_>) -> Result<(), ShapeError> {
        ShapeError::check("hits", hits.len(), "rays", rays.len())?;
        batch::intersect(&self.bvh, rays, &mut hits, |prim_ids, geom_ids| {
            self.name_geometries(prim_ids, geom_ids);
        });
        Ok(())
    }

    /// As [`Scene::intersect_batch`], on the rayon pool that it is called in.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many hits as rays.
    pub fn par_intersect_batch(&self, rays: Rays<'_>, hits: Hits<'_>) -> Result<(), ShapeError> {
        ShapeError::check("hits", hits.len(), "rays", rays.len())?;
        if rays.len() <= CHUNK {
            return self.intersect_batch(rays, hits);
        }
        // Halved at a whole chunk, so that the tiles are those of one thread.
        let middle = (rays.len() / 2).next_multiple_of(CHUNK);
        let (first, second) = hits.split_at(middle);
        let (a, b) = rayon::join(
            || self.par_intersect_batch(rays.range(0, middle), first),
            || self.par_intersect_batch(rays.range(middle, rays.len()), second),
        );
        a.and(b)
    }

    /// Whether each ray hits anything, on this thread.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many results as rays.
    pub fn occluded_batch(&self, rays: Rays<'_>, occluded: &mut [bool]) -> Result<(), ShapeError> {
        ShapeError::check("occluded", occluded.len(), "rays", rays.len())?;
        batch::occluded(&self.bvh, rays, occluded);
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
        occluded.par_chunks_mut(CHUNK).enumerate().try_for_each(|(chunk, occluded)| {
            let start = chunk * CHUNK;
            self.occluded_batch(rays.range(start, start + occluded.len()), occluded)
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
    #[inline(always)]
    fn name_geometries(&self, prim_ids: &mut [u32], geom_ids: &mut [u32]) {
        let second = self.first_ids.get(1).copied().unwrap_or(NO_HIT);
        let third = self.first_ids.get(2).copied().unwrap_or(NO_HIT);
        for (prim_id, geom_id) in prim_ids.iter_mut().zip(geom_ids.iter_mut()) {
            // Most scenes that are traced in bulk have one or two geometries.
            if *prim_id < second {
                *geom_id = 0;
            } else if *prim_id < third {
                *geom_id = 1;
                *prim_id -= second;
            } else if *prim_id == NO_HIT {
                *geom_id = NO_HIT;
            } else {
                let geometry = self.first_ids.partition_point(|&first| first <= *prim_id) - 1;
                *geom_id = geometry as u32;
                *prim_id -= self.first_ids[geometry];
            }
        }
    }

    /// The hit that a traversal found, its primitive by geometry.
    fn hit(&self, closest: &Closest) -> Hit {
        let geom_id = self.first_ids.partition_point(|&first| first <= closest.id) - 1;
        let prim_id = closest.id - self.first_ids[geom_id];
        Hit { t: closest.t, u: closest.u, v: closest.v, prim_id, geom_id: geom_id as u32 }
    }
}
