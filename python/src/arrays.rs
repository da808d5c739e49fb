//! Reading what Python gives: arrays of floats, without a copy where that is possible.
//!
//! C-contiguous arrays of float32 and float64 are read where they are; the tracer narrows the
//! latter while it reads them. Everything else, from strided arrays to lists, goes through NumPy.

use std::ops::Range;

use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// An array of floats that NumPy owns, C-contiguous, of any shape.
pub(crate) struct Floats<'py> {
    name: &'static str,
    shape: Vec<usize>,
    data: Data<'py>,
}

enum Data<'py> {
    F32(PyReadonlyArrayDyn<'py, f32>),
    F64(PyReadonlyArrayDyn<'py, f64>),
}

/// The values of [`Floats`], free of Python, so that threads can share them.
#[derive(Clone, Copy)]
pub(crate) enum Values<'a> {
    F32(&'a [f32]),
    F64(&'a [f64]),
}

impl<'py> Floats<'py> {
    /// Reads `object`, which errors call `name`.
    pub(crate) fn read(name: &'static str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Some(floats) = Self::in_place(name, object) {
            return Ok(floats);
        }
        let numpy = object.py().import("numpy")?;
        let array = numpy.call_method1("require", (object, "float32", ("C", "A")))?;
        Self::in_place(name, &array)
            .ok_or_else(|| PyValueError::new_err(format!("{name} is not an array of floats")))
    }

    fn in_place(name: &'static str, object: &Bound<'py, PyAny>) -> Option<Self> {
        let (shape, data) = if let Ok(array) = object.cast::<PyArrayDyn<f32>>() {
            let usable = array.is_c_contiguous() && array.is_aligned();
            (array.shape().to_vec(), Data::F32(usable.then(|| array.try_readonly().ok())??))
        } else if let Ok(array) = object.cast::<PyArrayDyn<f64>>() {
            let usable = array.is_c_contiguous() && array.is_aligned();
            (array.shape().to_vec(), Data::F64(usable.then(|| array.try_readonly().ok())??))
        } else {
            return None;
        };
        Some(Self { name, shape, data })
    }

    /// The length of each dimension.
    pub(crate) fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The shape in the way that Python writes it.
    pub(crate) fn shape_text(&self) -> String {
        shape_text(&self.shape)
    }

    /// How many rows of three values there are; one row may come without its outer dimension.
    pub(crate) fn rows(&self) -> PyResult<usize> {
        match self.shape[..] {
            [3] => Ok(1),
            [rows, 3] => Ok(rows),
            _ => {
                let (name, shape) = (self.name, self.shape_text());
                Err(PyValueError::new_err(format!("{name} has shape {shape}: it must be (n, 3)")))
            }
        }
    }

    /// The error for two arrays that do not go together.
    pub(crate) fn mismatch(&self, other: &Self) -> PyErr {
        PyValueError::new_err(format!(
            "{} has shape {} and {} has shape {}: give them one length",
            self.name,
            self.shape_text(),
            other.name,
            other.shape_text()
        ))
    }

    /// All values, row by row.
    pub(crate) fn values(&self) -> PyResult<Values<'_>> {
        Ok(match &self.data {
            Data::F32(array) => Values::F32(array.as_slice()?),
            Data::F64(array) => Values::F64(array.as_slice()?),
        })
    }

    /// A copy of all values as float32.
    pub(crate) fn to_vec(&self) -> PyResult<Vec<f32>> {
        Ok(match self.values()? {
            Values::F32(values) => values.to_vec(),
            Values::F64(values) => values.iter().map(|&value| value as f32).collect(),
        })
    }
}

impl Values<'_> {
    /// Value `index`. Panics if there is none.
    pub(crate) fn get(&self, index: usize) -> f32 {
        match self {
            Self::F32(values) => values[index],
            Self::F64(values) => values[index] as f32,
        }
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

/// A shape in the way that Python writes it: `(5, 3)`, `(5,)`, `()`.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [len] => format!("({len},)"),
        _ => {
            let lengths: Vec<_> = shape.iter().map(usize::to_string).collect();
            format!("({})", lengths.join(", "))
        }
    }
}
