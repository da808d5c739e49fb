//! The Python package `octray`: batches of rays as NumPy arrays against scenes.
//!
//! - `arrays`: reads what Python gives
//! - `geometry`, `scene`, `hits`: the classes
//! - `trace`: batches of rays into the library's queries
//! - `results`: arrays for what a query finds, whose memory is used again
//! - `normals`: the normals of hits
//! - `visibility`: how much of a light points see
//! - `render`: pictures of scene files
//! - `threads`: one pool, and Ctrl-C

mod arrays;
mod geometry;
mod hits;
mod normals;
mod render;
mod results;
mod scene;
mod threads;
mod trace;
mod visibility;

use pyo3::prelude::*;

/// Ray tracing on batches of rays, as NumPy arrays.
#[pymodule(name = "octray")]
mod module {
    #[pymodule_export]
    use crate::geometry::{Mesh, Quads, Spheres};
    #[pymodule_export]
    use crate::hits::Hits;
    #[pymodule_export]
    use crate::render::render;
    #[pymodule_export]
    use crate::scene::Scene;
    use pyo3::prelude::*;
    use pyo3::types::PyDict;

    /// The vector instruction sets that this build uses, and those that the CPU has: a dict of two
    /// lists, `build` and `cpu`.
    #[pyfunction]
    fn instruction_sets(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let found = octray::InstructionSets::detect();
        let sets = PyDict::new(py);
        sets.set_item("build", found.build)?;
        sets.set_item("cpu", found.cpu)?;
        Ok(sets)
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
