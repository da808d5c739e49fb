//! Batches of rays from rows of NumPy arrays: chunks that fit the cache, each turned into the SoA
//! arrays that the library traces right before it is traced.
//!
//! So a large batch goes through memory once, and each thread turns its own part of it.

use std::ops::Range;

use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use octray::{Hit, Hits, Ray, Rays};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyFloat;

use crate::arrays::{Floats, Values};
use crate::threads::for_each;

/// The most rays that a thread takes at a time. Their SoA arrays are 128 KB: they stay in the
/// second-level cache between the transposition and the trace.
const CHUNK: usize = 4096;

/// The fewest rays that are worth waking a thread for: whole tiles of the library.
const SMALLEST_CHUNK: usize = 512;

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
        let mut normals = vec![[0.0; 3]; if with_normals { self.len } else { 0 }];
        {
            let (mut t, mut u, mut v) =
                (hits.t.readwrite(), hits.u.readwrite(), hits.v.readwrite());
            let (mut prim_id, mut geom_id) = (hits.prim_id.readwrite(), hits.geom_id.readwrite());
            let chunk = self.chunk(threads);
            // A miss is -1 in Python: the same bits as `NO_HIT`.
            let mut rest = Some((
                Hits::new(
                    t.as_slice_mut()?,
                    u.as_slice_mut()?,
                    v.as_slice_mut()?,
                    bytemuck::cast_slice_mut(prim_id.as_slice_mut()?),
                    bytemuck::cast_slice_mut(geom_id.as_slice_mut()?),
                )
                .expect("the arrays were made with one length"),
                &mut normals[..],
            ));
            let parts = self.ranges(chunk).map(|range| {
                let (hits, normals) = rest.take().expect("ranges end where the rays end");
                let (part, hits) = hits.split_at(range.len());
                let (normal, normals) = normals.split_at_mut(range.len().min(normals.len()));
                rest = Some((hits, normals));
                (range, part, normal)
            });
            let source = self.source()?;
            let start = || Scratch::new(&source, chunk);
            for_each(py, threads, parts, start, |scratch, (range, mut part, normals)| {
                let rays = scratch.load(&source, range);
                let traced = scene.intersect_batch(rays, part.reborrow());
                traced.expect("there are as many hits as rays");
                for (index, normal) in normals.iter_mut().enumerate() {
                    *normal = normal_at(scene, &rays.get(index), &part.get(index));
                }
            })?;
        }
        let normals = with_normals.then(|| rows(py, normals)).transpose()?;
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
            let chunk = self.chunk(threads);
            let parts = self.ranges(chunk).zip(occluded.as_slice_mut()?.chunks_mut(chunk));
            let source = self.source()?;
            let start = || Scratch::new(&source, chunk);
            for_each(py, threads, parts, start, |scratch, (range, part)| {
                let traced = scene.occluded_batch(scratch.load(&source, range), part);
                traced.expect("there are as many results as rays");
            })?;
        }
        Ok(occluded)
    }

    /// How many rays a thread is to take at a time, so that all have something to do.
    fn chunk(&self, threads: usize) -> usize {
        chunk(self.len, threads)
    }

    fn ranges(&self, chunk: usize) -> impl Iterator<Item = Range<usize>> + Send + use<> {
        ranges(self.len, chunk)
    }

    fn source(&self) -> PyResult<Source<'_>> {
        Ok(Source {
            origins: Column::of_rows(&self.origins, self.len)?,
            directions: Column::of_rows(&self.directions, self.len)?,
            t_min: Column::of_ends(&self.t_min)?,
            t_max: Column::of_ends(&self.t_max)?,
        })
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
}

/// The normals of hits on flat primitives, which do not depend on the rays; zero for a miss.
pub(crate) fn flat_normals<'py>(
    py: Python<'py>,
    scene: &octray::Scene,
    prim_id: &[i32],
    geom_id: &[i32],
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let len = prim_id.len().min(geom_id.len());
    let mut normals = vec![[0.0; 3]; len];
    let chunk = chunk(len, threads);
    let parts = ranges(len, chunk).zip(normals.chunks_mut(chunk));
    for_each(
        py,
        threads,
        parts,
        || (),
        |(), (range, part)| {
            for (index, normal) in range.zip(part) {
                // A miss names nothing; and the arrays may have been written to since.
                let found = scene.flat_normal(geom_id[index] as u32, prim_id[index] as u32);
                *normal = found.map_or([0.0; 3], |normal| normal.to_array());
            }
        },
    )?;
    rows(py, normals)
}

fn normal_at(scene: &octray::Scene, ray: &Ray, hit: &Hit) -> [f32; 3] {
    if hit.is_hit() { scene.surface(ray, hit).geometric_normal.to_array() } else { [0.0; 3] }
}

fn rows<'py>(py: Python<'py>, rows: Vec<[f32; 3]>) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let len = rows.len();
    rows.into_flattened().into_pyarray(py).reshape([len, 3])
}

/// An array for a query to fill. NumPy's own `empty` takes huge pages for large ones and clears
/// nothing: with `zeros` a tenth of the time of coherent rays went into clearing memory.
pub(crate) fn empty<'py, T: Element>(
    py: Python<'py>,
    len: usize,
) -> PyResult<Bound<'py, PyArray1<T>>> {
    static EMPTY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let array = EMPTY.import(py, "numpy", "empty")?.call1((len, T::get_dtype(py)))?;
    Ok(array.cast_into()?)
}

pub(crate) fn chunk(len: usize, threads: usize) -> usize {
    len.div_ceil(4 * threads).next_multiple_of(SMALLEST_CHUNK).clamp(SMALLEST_CHUNK, CHUNK)
}

pub(crate) fn ranges(len: usize, chunk: usize) -> impl Iterator<Item = Range<usize>> + Send {
    (0..len).step_by(chunk).map(move |start| start..(start + chunk).min(len))
}

/// The arrays of [`Batch`] for threads that know nothing of Python.
struct Source<'a> {
    origins: Column<'a, [f32; 3]>,
    directions: Column<'a, [f32; 3]>,
    t_min: Column<'a, f32>,
    t_max: Column<'a, f32>,
}

/// One value for all rays, or an array with one a ray.
enum Column<'a, T> {
    Same(T),
    Each(Values<'a>),
}

impl<'a> Column<'a, [f32; 3]> {
    fn of_rows(rows: &'a Floats<'_>, len: usize) -> PyResult<Self> {
        let values = rows.values()?;
        let is_same = rows.rows()? == 1 && len != 1;
        let same = || Self::Same(std::array::from_fn(|axis| values.get(axis)));
        Ok(if is_same { same() } else { Self::Each(values) })
    }
}

impl<'a> Column<'a, f32> {
    fn of_ends(ends: &'a Ends<'_>) -> PyResult<Self> {
        Ok(match ends {
            Ends::Same(value) => Self::Same(*value),
            Ends::Each(array) => Self::Each(array.values()?),
        })
    }
}

/// The SoA arrays of one chunk: what a thread keeps.
struct Scratch {
    origin: [Vec<f32>; 3],
    dir: [Vec<f32>; 3],
    t_min: Vec<f32>,
    t_max: Vec<f32>,
}

impl Scratch {
    /// Room for `len` rays. What they share is filled in for good.
    fn new(source: &Source<'_>, len: usize) -> Self {
        let rows = |rows: &Column<'_, [f32; 3]>| match rows {
            Column::Same(row) => row.map(|value| vec![value; len]),
            Column::Each(_) => std::array::from_fn(|_| vec![0.0; len]),
        };
        let ends = |ends: &Column<'_, f32>| match ends {
            Column::Same(value) => vec![*value; len],
            Column::Each(_) => vec![0.0; len],
        };
        Self {
            origin: rows(&source.origins),
            dir: rows(&source.directions),
            t_min: ends(&source.t_min),
            t_max: ends(&source.t_max),
        }
    }

    /// The rays of `range`.
    fn load(&mut self, source: &Source<'_>, range: Range<usize>) -> Rays<'_> {
        let rows = [(&source.origins, &mut self.origin), (&source.directions, &mut self.dir)];
        for (from, to) in rows {
            if let Column::Each(values) = from {
                transpose(values, &range, to.each_mut());
            }
        }
        for (from, to) in [(&source.t_min, &mut self.t_min), (&source.t_max, &mut self.t_max)] {
            if let Column::Each(values) = from {
                copy(values, &range, to);
            }
        }
        let len = range.len();
        let ([x, y, z], [dx, dy, dz]) = (&self.origin, &self.dir);
        let (t_min, t_max) = (&self.t_min[..len], &self.t_max[..len]);
        Rays::new(&x[..len], &y[..len], &z[..len], &dx[..len], &dy[..len], &dz[..len], t_min, t_max)
            .expect("all have one length")
    }
}

/// Rows of three values, as three arrays.
pub(crate) fn transpose(from: &Values<'_>, range: &Range<usize>, to: [&mut Vec<f32>; 3]) {
    fn rows<T: Copy>(from: &[T], [x, y, z]: [&mut Vec<f32>; 3], narrow: impl Fn(T) -> f32) {
        let rows = from.as_chunks::<3>().0;
        let len = rows.len();
        let (x, y, z) = (&mut x[..len], &mut y[..len], &mut z[..len]);
        for index in 0..len {
            let row = rows[index];
            x[index] = narrow(row[0]);
            y[index] = narrow(row[1]);
            z[index] = narrow(row[2]);
        }
    }
    let part = 3 * range.start..3 * range.end;
    match from {
        Values::F32(from) => rows(&from[part], to, |value| value),
        Values::F64(from) => rows(&from[part], to, |value| value as f32),
    }
}

fn copy(from: &Values<'_>, range: &Range<usize>, to: &mut [f32]) {
    let to = &mut to[..range.len()];
    match from {
        Values::F32(from) => to.copy_from_slice(&from[range.clone()]),
        Values::F64(from) => {
            for (to, &value) in to.iter_mut().zip(&from[range.clone()]) {
                *to = value as f32;
            }
        }
    }
}
