//! How much of a light points see: rows of NumPy arrays into the library's visibility query.

use std::ops::Range;

use numpy::{PyArray1, PyArrayMethods};
use octray::glam::Vec3;
use octray::shading::sampling::{SampleKey, StratifiedSet};
use octray::{LightSamples, LightShape, Points, ShapeError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Floats, Values, transpose};
use crate::results::empty;
use crate::threads::{chunk, for_each, ranges};

/// The most samples that a point may have.
const MAX_SAMPLES: usize = octray::scene::MAX_SAMPLES as usize;

/// The points and samples of a call, as Python gave them.
pub(crate) struct Question<'py> {
    points: Floats<'py>,
    normals: Option<Floats<'py>>,
    light: LightShape,
    samples: Samples<'py>,
    seed: u64,
}

/// A number of samples for each point, or where they lie.
enum Samples<'py> {
    Count(u32),
    Each(Floats<'py>, usize),
}

impl<'py> Question<'py> {
    /// Reads the arguments.
    pub(crate) fn read(
        points: &Bound<'py, PyAny>,
        light: &Bound<'py, PyAny>,
        samples: Option<&Bound<'py, PyAny>>,
        normals: Option<&Bound<'py, PyAny>>,
        seed: u64,
    ) -> PyResult<Self> {
        let points = Floats::read("points", points)?;
        let len = points.rows()?;
        let normals = normals.map(|normals| Floats::read("normals", normals)).transpose()?;
        if let Some(normals) = &normals
            && normals.rows()? != len
        {
            return Err(points.mismatch(normals));
        }
        let light = read_light(&Floats::read("light", light)?)?;
        let samples = match samples {
            None => Samples::Count(16),
            Some(samples) => Samples::read(samples, &points, len)?,
        };
        Ok(Self { points, normals, light, samples, seed })
    }

    /// The fraction of its samples that each point sees.
    pub(crate) fn fractions(
        &self,
        py: Python<'py>,
        scene: &octray::Scene,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let len = self.points.rows()?;
        let fractions = empty(py, len)?;
        {
            let mut fractions = fractions.readwrite();
            let chunk = chunk(len, threads);
            let parts = ranges(len, chunk).zip(fractions.as_slice_mut()?.chunks_mut(chunk));
            let points = self.points.values()?;
            let normals = self.normals.as_ref().map(Floats::values).transpose()?;
            let samples = match &self.samples {
                Samples::Count(count) => Placed::Sets(*count, self.seed),
                Samples::Each(places, count) => Placed::Each(places.values()?, *count),
            };
            let light = self.light;
            let start = || [(); 6].map(|()| vec![0.0; chunk]);
            for_each(py, threads, parts, start, |scratch, (range, part): (Range<usize>, _)| {
                let [x, y, z, nx, ny, nz] = scratch;
                transpose(&points, &range, [x, y, z]);
                let len = range.len();
                let asked = Points::new(&x[..len], &y[..len], &z[..len]).and_then(|points| {
                    let points = match &normals {
                        None => points,
                        Some(normals) => {
                            transpose(normals, &range, [nx, ny, nz]);
                            points.with_normals(&nx[..len], &ny[..len], &nz[..len])?
                        }
                    };
                    let samples = From { samples, first: range.start };
                    scene.visibility(&points, &light, &samples, part)
                });
                asked.expect("all have one length");
            })?;
        }
        Ok(fractions)
    }
}

impl<'py> Samples<'py> {
    fn read(object: &Bound<'py, PyAny>, points: &Floats<'py>, len: usize) -> PyResult<Self> {
        if let Ok(count) = object.extract::<i64>() {
            return match usize::try_from(count) {
                Ok(1..=MAX_SAMPLES) => Ok(Self::Count(count as u32)),
                _ => Err(PyValueError::new_err(format!(
                    "samples is {count}: give 1 to {MAX_SAMPLES}, or an array (n, s, 2)"
                ))),
            };
        }
        let places = Floats::read("samples", object)?;
        match *places.shape() {
            [points, count, 2] if points == len => Ok(Self::Each(places, count)),
            [_, _, 2] => Err(places.mismatch(points)),
            _ => Err(PyValueError::new_err(format!(
                "samples has shape {}: it must be a number or (n, s, 2)",
                places.shape_text()
            ))),
        }
    }
}

/// One row is a point, three are the corner and the edges of a parallelogram.
fn read_light(light: &Floats<'_>) -> PyResult<LightShape> {
    let values = light.to_vec()?;
    let row = |row: usize| Vec3::from_slice(&values[3 * row..]);
    match light.shape() {
        [3] => Ok(LightShape::Point(row(0))),
        [3, 3] => Ok(LightShape::Quad { corner: row(0), edge_u: row(1), edge_v: row(2) }),
        _ => Err(PyValueError::new_err(format!(
            "light has shape {}: it must be (3,), a point, or (3, 3), a corner and two edges",
            light.shape_text()
        ))),
    }
}

/// Where the samples of all points lie.
#[derive(Clone, Copy)]
enum Placed<'a> {
    /// So many in stratified sets, fixed by the point's number and the seed.
    Sets(u32, u64),
    /// So many for each point, two values each.
    Each(Values<'a>, usize),
}

/// The samples of the points from `first` on.
struct From<'a> {
    samples: Placed<'a>,
    first: usize,
}

impl LightSamples for From<'_> {
    fn per_point(&self) -> usize {
        match self.samples {
            Placed::Sets(count, _) => count as usize,
            Placed::Each(_, count) => count,
        }
    }

    fn check(&self, _: usize) -> Result<(), ShapeError> {
        Ok(())
    }

    fn place(&self, point: usize, u: &mut [f32], v: &mut [f32]) {
        let point = self.first + point;
        match self.samples {
            Placed::Sets(count, seed) => {
                let key = SampleKey::new(point as u32, (point >> 32) as u32, 0, seed);
                StratifiedSet::new(key, count).fill(0, u, v);
            }
            Placed::Each(values, count) => {
                let first = 2 * point * count;
                for (sample, (u, v)) in u.iter_mut().zip(v).enumerate() {
                    *u = values.get(first + 2 * sample);
                    *v = values.get(first + 2 * sample + 1);
                }
            }
        }
    }
}
