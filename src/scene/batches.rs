//! Batches: the queries for rays of any number, in arrays or in rows, on one thread or many, and for callers
//! that may end them early. Their answers are those of the queries for one ray.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::batch_rays::BatchRays;
use crate::error::ShapeError;
use crate::hit::Hits;
use crate::pages::Pages;
use crate::scene::Scene;
use crate::share_out::share_out;
use crate::traverse::batch;
use crate::traverse::sorted::Sorted;

/// The most rays that a thread takes at a time: many tiles, since nobody has asked for the rays of the first
/// one. Camera rays in chunks of 16 tiles take 1.05 times as long.
const CHUNK: usize = 64 * batch::TILE_RAYS;

/// The fewest: what is left when a batch ends is then short.
const SMALLEST_CHUNK: usize = 2 * batch::TILE_RAYS;

/// How many rays are sorted together at most. Twice as many would be no faster, and could not use the
/// memory of the sort before.
const SPAN: usize = 1 << 21;

/// How a batch is traced, and how far it has come.
struct Course<'a> {
    parallel: bool,
    go_on: Option<&'a (dyn Fn() -> bool + Sync)>,
    ended: AtomicBool,
}

impl<'a> Course<'a> {
    fn new(parallel: bool, go_on: Option<&'a (dyn Fn() -> bool + Sync)>) -> Self {
        Self { parallel, go_on, ended: AtomicBool::new(false) }
    }

    /// False for good once the caller said so.
    fn goes_on(&self) -> bool {
        let Some(go_on) = self.go_on else { return true };
        if !self.ended.load(Ordering::Relaxed) && !go_on() {
            self.ended.store(true, Ordering::Relaxed);
        }
        !self.ended.load(Ordering::Relaxed)
    }

    /// How many rays of a batch are to be traced at a time: whole tiles.
    fn chunk(&self, rays: usize) -> usize {
        let threads = if self.parallel { rayon::current_num_threads() } else { 1 };
        if threads > 1 {
            let fair = rays / (8 * threads);
            fair.next_multiple_of(batch::TILE_RAYS).clamp(SMALLEST_CHUNK, CHUNK)
        } else if self.go_on.is_some() {
            CHUNK
        } else {
            rays.max(1)
        }
    }
}

impl Scene {
    /// The closest hit of each ray, on this thread. Rays come field by field ([`crate::Rays`]) or in rows
    /// ([`crate::RayRows`]), in any order and number; neighbours that run alike are traced together. Many
    /// rays that share about one start or one end but come in no order are sorted first, two million at
    /// a time, which takes 56 bytes a ray; up to 512 MB of them are kept for the next call.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many hits as rays.
    pub fn intersect_batch<'a>(
        &self,
        rays: impl Into<BatchRays<'a>>,
        hits: Hits<'_>,
    ) -> Result<(), ShapeError> {
        self.intersect_spans(rays.into(), hits, &Course::new(false, None))
    }

    /// As [`Scene::intersect_batch`], on the rayon pool that it is called in and on the calling thread.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many hits as rays.
    pub fn par_intersect_batch<'a>(
        &self,
        rays: impl Into<BatchRays<'a>>,
        hits: Hits<'_>,
    ) -> Result<(), ShapeError> {
        self.intersect_spans(rays.into(), hits, &Course::new(true, None))
    }

    /// As [`Scene::intersect_batch`], or as [`Scene::par_intersect_batch`] if `parallel`, for as long as
    /// `go_on` says so. It is asked now and then, from the threads that trace. False if it ended the
    /// query; hits that are missing then may hold anything.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many hits as rays.
    pub fn intersect_batch_while<'a>(
        &self,
        rays: impl Into<BatchRays<'a>>,
        hits: Hits<'_>,
        parallel: bool,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool, ShapeError> {
        let course = Course::new(parallel, Some(go_on));
        self.intersect_spans(rays.into(), hits, &course)?;
        Ok(!course.ended.into_inner())
    }

    /// True if the batch queries would sort these rays first (the first two million, if there are more): for
    /// callers that would rather cut a batch into parts of their own, which are as fast if it is not sorted.
    pub fn sorts_batch<'a>(&self, rays: impl Into<BatchRays<'a>>) -> bool {
        let rays = rays.into();
        spans(rays.len())
            .next()
            .is_some_and(|(start, end)| Sorted::is_worth(&rays.range(start, end), &self.bvh))
    }

    fn intersect_spans(
        &self,
        rays: BatchRays<'_>,
        mut hits: Hits<'_>,
        course: &Course<'_>,
    ) -> Result<(), ShapeError> {
        ShapeError::check("hits", hits.len(), "rays", rays.len())?;
        for (start, end) in spans(rays.len()) {
            let (part, rest) = hits.split_at(end - start);
            hits = rest;
            self.intersect_span(rays.range(start, end), part, course);
        }
        Ok(())
    }

    fn intersect_span(&self, rays: BatchRays<'_>, hits: Hits<'_>, course: &Course<'_>) {
        let chunk = course.chunk(rays.len());
        let parallel = course.parallel && rays.len() > chunk;
        if let Some(sorted) = Sorted::new(&rays, &self.bvh, course.parallel) {
            let found = self.intersect_sorted(&sorted, course);
            share_out(chunks(hits, chunk), parallel, |(start, mut hits)| {
                self.give_hits(sorted.give(&found, start), &mut hits);
            });
        } else {
            share_out(chunks(hits, chunk), parallel, |(start, mut hits)| {
                if course.goes_on() {
                    let rays = rays.range(start, start + hits.len());
                    batch::intersect(&self.bvh, rays, &mut hits, |ids| self.name(ids));
                }
            });
        }
    }

    /// `t`, `u`, `v` and the id over all geometries.
    fn intersect_sorted(&self, sorted: &Sorted, course: &Course<'_>) -> Pages<[u32; 4]> {
        sorted.trace(|rays, places, found: &mut [[u32; 4]]| {
            if !course.goes_on() {
                return;
            }
            batch::intersect_each(&self.bvh, rays, |index, hit| {
                found[places[index] as usize] = hit
            });
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
    pub fn occluded_batch<'a>(
        &self,
        rays: impl Into<BatchRays<'a>>,
        occluded: &mut [bool],
    ) -> Result<(), ShapeError> {
        self.occluded_spans(rays.into(), occluded, &Course::new(false, None))
    }

    /// As [`Scene::occluded_batch`], on the rayon pool that it is called in and on the calling thread.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many results as rays.
    pub fn par_occluded_batch<'a>(
        &self,
        rays: impl Into<BatchRays<'a>>,
        occluded: &mut [bool],
    ) -> Result<(), ShapeError> {
        self.occluded_spans(rays.into(), occluded, &Course::new(true, None))
    }

    /// As [`Scene::occluded_batch`], for as long as [`Scene::intersect_batch_while`] would go on.
    ///
    /// # Errors
    /// [`ShapeError`] if there are not as many results as rays.
    pub fn occluded_batch_while<'a>(
        &self,
        rays: impl Into<BatchRays<'a>>,
        occluded: &mut [bool],
        parallel: bool,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool, ShapeError> {
        let course = Course::new(parallel, Some(go_on));
        self.occluded_spans(rays.into(), occluded, &course)?;
        Ok(!course.ended.into_inner())
    }

    fn occluded_spans(
        &self,
        rays: BatchRays<'_>,
        mut occluded: &mut [bool],
        course: &Course<'_>,
    ) -> Result<(), ShapeError> {
        ShapeError::check("occluded", occluded.len(), "rays", rays.len())?;
        for (start, end) in spans(rays.len()) {
            let (part, rest) = occluded.split_at_mut(end - start);
            occluded = rest;
            self.occluded_span(rays.range(start, end), part, course);
        }
        Ok(())
    }

    fn occluded_span(&self, rays: BatchRays<'_>, occluded: &mut [bool], course: &Course<'_>) {
        let chunk = course.chunk(rays.len());
        let parallel = course.parallel && rays.len() > chunk;
        let chunks = occluded.chunks_mut(chunk).enumerate();
        if let Some(sorted) = Sorted::new(&rays, &self.bvh, course.parallel) {
            let found = self.occluded_sorted(&sorted, course);
            share_out(chunks, parallel, |(number, occluded)| {
                let found = sorted.give(&found, number * chunk);
                for (occluded, found) in occluded.iter_mut().zip(found) {
                    *occluded = found != 0;
                }
            });
        } else {
            share_out(chunks, parallel, |(number, occluded)| {
                if course.goes_on() {
                    let start = number * chunk;
                    let rays = rays.range(start, start + occluded.len());
                    batch::occluded(&self.bvh, rays, occluded);
                }
            });
        }
    }

    fn occluded_sorted(&self, sorted: &Sorted, course: &Course<'_>) -> Pages<u8> {
        sorted.trace(|rays, places, found: &mut [u8]| {
            if !course.goes_on() {
                return;
            }
            let mut occluded = vec![false; rays.len()];
            batch::occluded(&self.bvh, rays, &mut occluded);
            for (&place, occluded) in places.iter().zip(occluded) {
                found[place as usize] = u8::from(occluded);
            }
        })
    }
}

/// Where the parts of so many rays that may be sorted together start and end: nearly alike in length.
fn spans(rays: usize) -> impl Iterator<Item = (usize, usize)> {
    let len = rays.div_ceil(rays.div_ceil(SPAN).max(1)).max(1);
    (0..rays).step_by(len).map(move |start| (start, (start + len).min(rays)))
}

/// The hits in chunks, each with the place of its first one.
fn chunks(hits: Hits<'_>, chunk: usize) -> impl Iterator<Item = (usize, Hits<'_>)> {
    let (mut start, mut rest) = (0, Some(hits));
    std::iter::from_fn(move || {
        let hits = rest.take().filter(|hits| !hits.is_empty())?;
        let len = chunk.min(hits.len());
        let (first, more) = hits.split_at(len);
        rest = Some(more);
        start += len;
        Some((start - len, first))
    })
}
