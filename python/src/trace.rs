//! Batches of rays: rows of NumPy arrays into the library's queries, and hits into arrays.
//!
//! The library reads the rows where they are and sees the whole batch: it turns rows while it traces them,
//! and it may sort them.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use octray::{BatchRays, Hits, RayRows, Rows};
use pyo3::prelude::*;
use pyo3::types::PyFloat;

use crate::arrays::{Floats, Values};
use crate::normals::normals_on_rays;
use crate::results::empty;
use crate::threads::{for_each, ranges, run};

/// So many rays are not worth waking a thread for: 5,000 camera rays took 26 microseconds on one thread and 60
/// to 85 on two, most of which is waiting for the second.
const FEW: usize = 4096;

/// How many rays a thread takes at a time, at least and at most, of those that the library does not sort.
const SMALLEST_PART: usize = 4096;
const LARGEST_PART: usize = 65_536;

/// The rays of a call, as Python gave them.
pub(crate) struct Batch<'py> {
    origins: Floats<'py>,
    directions: Floats<'py>,
    t_min: Ends<'py>,
    t_max: Ends<'py>,
    len: usize,
}

/// The first or last `t` of rays: one for all, or one a ray.
enum Ends<'py> {
    Same(f32),
    Each(Floats<'py>),
}

/// The arrays of closest hits, without those of the normals.
pub(crate) struct HitArrays<'py> {
    pub(crate) t: Bound<'py, PyArray1<f32>>,
    pub(crate) u: Bound<'py, PyArray1<f32>>,
    pub(crate) v: Bound<'py, PyArray1<f32>>,
    pub(crate) prim_id: Bound<'py, PyArray1<i32>>,
    pub(crate) geom_id: Bound<'py, PyArray1<i32>>,
}

impl<'py> Batch<'py> {
    /// Reads the arguments. One row of origins or directions goes with any number of the other;
    /// the ends of the rays are one number or one a ray.
    pub(crate) fn read(
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: Option<&Bound<'py, PyAny>>,
        t_max: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let origins = Floats::read("origins", origins)?;
        let directions = Floats::read("directions", directions)?;
        let len = match (origins.rows()?, directions.rows()?) {
            (1, len) | (len, 1) => len,
            (len, other) if len == other => len,
            _ => return Err(origins.mismatch(&directions)),
        };
        let rays = if origins.rows()? == len { &origins } else { &directions };
        let t_min = Ends::read("t_min", t_min, 0.0, rays, len)?;
        let t_max = Ends::read("t_max", t_max, f32::INFINITY, rays, len)?;
        Ok(Self { origins, directions, t_min, t_max, len })
    }

    /// The closest hits, and their normals if `with_normals`.
    pub(crate) fn intersect(
        &self,
        py: Python<'py>,
        scene: &octray::Scene,
        threads: usize,
        with_normals: bool,
    ) -> PyResult<(HitArrays<'py>, Option<Bound<'py, PyArray2<f32>>>)> {
        let hits = HitArrays {
            t: empty(py, self.len)?,
            u: empty(py, self.len)?,
            v: empty(py, self.len)?,
            prim_id: empty(py, self.len)?,
            geom_id: empty(py, self.len)?,
        };
        let rays = self.rays()?;
        let mut normals = None;
        {
            let (mut t, mut u, mut v) =
                (hits.t.readwrite(), hits.u.readwrite(), hits.v.readwrite());
            let (mut prim_id, mut geom_id) = (hits.prim_id.readwrite(), hits.geom_id.readwrite());
            let (t, u, v) = (t.as_slice_mut()?, u.as_slice_mut()?, v.as_slice_mut()?);
            let (prim_id, geom_id) = (prim_id.as_slice_mut()?, geom_id.as_slice_mut()?);
            // A miss is -1 in Python: the same bits as `NO_HIT`.
            let [prims, geometries] = [&mut *prim_id, &mut *geom_id].map(bytemuck::cast_slice_mut);
            let mut all = Hits::new(&mut *t, &mut *u, &mut *v, prims, geometries)
                .expect("the arrays were made with one length");
            if let Some(part) = self.part(py, scene, rays, threads) {
                let mut rest = Some(all);
                let parts = ranges(self.len, part).map(|range| {
                    let (hits, after) = rest.take()?.split_at(range.len());
                    rest = Some(after);
                    Some((rays.range(range.start, range.end), hits))
                });
                for_each(
                    py,
                    threads,
                    parts.flatten(),
                    || (),
                    |(), (rays, hits)| {
                        scene.intersect_batch(rays, hits).expect("there are as many hits as rays");
                    },
                )?;
            } else {
                run(py, self.threads(threads), |parallel, go_on| {
                    scene
                        .intersect_batch_while(rays, all.reborrow(), parallel, go_on)
                        .expect("there are as many hits as rays")
                })?;
            }
            if with_normals {
                let hits = ([&*t, &*u, &*v], [&*prim_id, &*geom_id]);
                normals = Some(normals_on_rays(py, scene, &rays, hits, threads)?);
            }
        }
        Ok((hits, normals))
    }

    /// Whether each ray hits anything.
    pub(crate) fn occluded(
        &self,
        py: Python<'py>,
        scene: &octray::Scene,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let occluded = PyArray1::<bool>::zeros(py, self.len, false);
        {
            let mut occluded = occluded.readwrite();
            let (rays, occluded) = (self.rays()?, occluded.as_slice_mut()?);
            if let Some(part) = self.part(py, scene, rays, threads) {
                let parts = ranges(self.len, part).zip(occluded.chunks_mut(part));
                for_each(
                    py,
                    threads,
                    parts,
                    || (),
                    |(), (range, occluded)| {
                        let traced =
                            scene.occluded_batch(rays.range(range.start, range.end), occluded);
                        traced.expect("there are as many results as rays");
                    },
                )?;
            } else {
                run(py, self.threads(threads), |parallel, go_on| {
                    let traced = scene.occluded_batch_while(rays, occluded, parallel, go_on);
                    traced.expect("there are as many results as rays")
                })?;
            }
        }
        Ok(occluded)
    }

    /// How many threads are to trace, of so many.
    fn threads(&self, threads: usize) -> usize {
        if self.len <= FEW { 1 } else { threads }
    }

    /// How many rays each thread is to take at a time; `None` if the library should have all at once, since
    /// one thread traces them or they are to be sorted.
    ///
    /// With parts, the calling thread traces, too. If it slept meanwhile, as it does for the library's own
    /// threads, those two often came to one of two cores: 75 million rays a second, not 122.
    fn part(
        &self,
        py: Python<'_>,
        scene: &octray::Scene,
        rays: BatchRays<'_>,
        threads: usize,
    ) -> Option<usize> {
        let alone = self.threads(threads) == 1 || py.detach(|| scene.sorts_batch(rays));
        let fair = self.len.div_ceil(8 * threads).next_multiple_of(SMALLEST_PART);
        (!alone).then_some(fair.clamp(SMALLEST_PART, LARGEST_PART))
    }

    fn rays(&self) -> PyResult<BatchRays<'_>> {
        let origins = rows_of(&self.origins, self.len)?;
        let dirs = rows_of(&self.directions, self.len)?;
        let (t_min, t_max) = (self.t_min.values()?, self.t_max.values()?);
        let rays = RayRows::new(self.len, origins, dirs, t_min, t_max);
        Ok(rays.expect("the lengths were compared before").into())
    }
}

impl<'py> Ends<'py> {
    fn read(
        name: &'static str,
        object: Option<&Bound<'py, PyAny>>,
        default: f32,
        rays: &Floats<'py>,
        len: usize,
    ) -> PyResult<Self> {
        let Some(object) = object else { return Ok(Self::Same(default)) };
        if let Ok(number) = object.cast::<PyFloat>() {
            return Ok(Self::Same(number.value() as f32));
        }
        let ends = Floats::read(name, object)?;
        match ends.shape() {
            [] => Ok(Self::Same(ends.values()?.get(0))),
            [count] if *count == len => Ok(Self::Each(ends)),
            _ => Err(ends.mismatch(rays)),
        }
    }

    fn values(&self) -> PyResult<octray::Ends<'_>> {
        Ok(match self {
            Self::Same(end) => octray::Ends::Same(*end),
            Self::Each(array) => match array.values()? {
                Values::F32(ends) => octray::Ends::F32(ends),
                Values::F64(ends) => octray::Ends::F64(ends),
            },
        })
    }
}

/// The rows of so many rays; one row is for all of them.
fn rows_of<'a>(floats: &'a Floats<'_>, len: usize) -> PyResult<Rows<'a>> {
    let values = floats.values()?;
    if len != 1 && floats.rows()? == 1 {
        return Ok(Rows::Same(std::array::from_fn(|axis| values.get(axis))));
    }
    Ok(match values {
        Values::F32(values) => Rows::F32(values.as_chunks().0),
        Values::F64(values) => Rows::F64(values.as_chunks().0),
    })
}
