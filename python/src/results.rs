//! Arrays for results, whose memory is used again.
//!
//! The first use of a page is a call into the system, which clears it: with memory from the system, that
//! took up to a third of the time of coherent rays. So large results lie in the library's own pages, which
//! are kept for the next call as soon as no array looks into them.

use std::ops::RangeInclusive;

use numpy::{Element, PyArray1};
use octray::pages::Pages;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

/// What the library keeps: smaller arrays it makes anew, as NumPy does, and larger ones it gives back.
const KEPT: RangeInclusive<usize> = 3 << 19..=64 << 20;

/// The memory of one array, to which the array refers.
#[pyclass(frozen, module = "octray")]
struct Memory {
    /// Nothing reads or writes these but the array, by the address.
    _pages: Pages<u8>,
    address: usize,
    len: usize,
    kind: Py<PyAny>,
}

#[pymethods]
impl Memory {
    /// What NumPy makes an array of.
    #[getter(__array_interface__)]
    fn array_interface<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("shape", (self.len,))?;
        interface.set_item("typestr", &self.kind)?;
        interface.set_item("data", (self.address, false))?;
        Ok(interface)
    }
}

/// An array of `len` values, whatever they are.
pub(crate) fn empty<T: Element>(py: Python<'_>, len: usize) -> PyResult<Bound<'_, PyArray1<T>>> {
    static EMPTY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let (kind, bytes) = (T::get_dtype(py), len * size_of::<T>());
    let array = if KEPT.contains(&bytes) {
        let mut pages = Pages::<u8>::new(bytes);
        let address = pages.as_mut_ptr().expose_provenance();
        let kind = kind.getattr("str")?.unbind();
        let memory = Bound::new(py, Memory { _pages: pages, address, len, kind })?;
        ASARRAY.import(py, "numpy", "asarray")?.call1((memory,))?
    } else {
        EMPTY.import(py, "numpy", "empty")?.call1((len, kind))?
    };
    Ok(array.cast_into()?)
}
