//! `Hits`: the closest hits of a batch of rays as NumPy arrays, the normals on demand.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyTuple;

use crate::scene::Scene;
use crate::trace::HitArrays;

/// The names of the arrays, in the order in which a pickle has them.
const NAMES: [&str; 6] = ["t", "u", "v", "prim_id", "geom_id", "normal"];

/// The closest hits of a batch of rays: one array a value, one entry a ray.
///
/// A ray that hit nothing has t = inf, u = v = 0, both ids -1 and a normal of zeros. `dict(hits)`
/// and `numpy.savez(file, **hits)` take all arrays by their names.
#[pyclass(frozen, module = "octray", mapping)]
pub(crate) struct Hits {
    /// Distances in lengths of the rays' directions, float32, (n,).
    #[pyo3(get)]
    t: Py<PyArray1<f32>>,
    /// First surface coordinates, float32, (n,). Triangles: the weight of the second vertex;
    /// quads: along edges_u; spheres: 0.
    #[pyo3(get)]
    u: Py<PyArray1<f32>>,
    /// Second surface coordinates, float32, (n,). Triangles: the weight of the third vertex;
    /// quads: along edges_v; spheres: 0.
    #[pyo3(get)]
    v: Py<PyArray1<f32>>,
    /// Which primitive of its geometry, int32, (n,).
    #[pyo3(get)]
    prim_id: Py<PyArray1<i32>>,
    /// Which geometry of the scene, int32, (n,).
    #[pyo3(get)]
    geom_id: Py<PyArray1<i32>>,
    normal: PyOnceLock<Py<PyArray2<f32>>>,
    /// What the normals come from, and on how many threads.
    scene: Option<(Py<Scene>, usize)>,
}

impl Hits {
    /// The hits of a query of `scene`.
    pub(crate) fn of(
        py: Python<'_>,
        arrays: HitArrays<'_>,
        normal: Option<Bound<'_, PyArray2<f32>>>,
        scene: Py<Scene>,
        threads: usize,
    ) -> Self {
        let HitArrays { t, u, v, prim_id, geom_id } = arrays;
        let (t, u, v) = (t.unbind(), u.unbind(), v.unbind());
        Self {
            t,
            u,
            v,
            prim_id: prim_id.unbind(),
            geom_id: geom_id.unbind(),
            normal: normal.map_or_else(PyOnceLock::new, |normal| filled(py, normal.unbind())),
            scene: Some((scene, threads)),
        }
    }
}

#[pymethods]
impl Hits {
    #[new]
    fn new(
        py: Python<'_>,
        t: Py<PyArray1<f32>>,
        u: Py<PyArray1<f32>>,
        v: Py<PyArray1<f32>>,
        prim_id: Py<PyArray1<i32>>,
        geom_id: Py<PyArray1<i32>>,
        normal: Py<PyArray2<f32>>,
    ) -> Self {
        Self { t, u, v, prim_id, geom_id, normal: filled(py, normal), scene: None }
    }

    /// Unit geometric normals, float32, (n, 3): not turned towards the rays; zero for a miss.
    ///
    /// Triangles: (v1 - v0) x (v2 - v0); quads: edges_u x edges_v; spheres: outwards. In a scene
    /// without spheres they are computed when they are first asked for.
    #[getter]
    fn normal(&self, py: Python<'_>) -> PyResult<Py<PyArray2<f32>>> {
        let compute = || match &self.scene {
            Some((scene, threads)) => {
                let prim_id = self.prim_id.bind(py).try_readonly()?;
                let geom_id = self.geom_id.bind(py).try_readonly()?;
                let (prim_id, geom_id) = (prim_id.as_slice()?, geom_id.as_slice()?);
                scene.get().flat_normals(py, (prim_id, geom_id), *threads).map(Bound::unbind)
            }
            None => Ok(PyArray2::zeros(py, [self.__len__(py), 3], false).unbind()),
        };
        Ok(self.normal.get_or_try_init(py, compute)?.clone_ref(py))
    }

    /// Which rays hit anything, bool, (n,).
    #[getter]
    fn hit<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.geom_id.bind(py).as_any().rich_compare(0, pyo3::pyclass::CompareOp::Ge)
    }

    /// The names of the arrays.
    fn keys(&self) -> [&'static str; 6] {
        NAMES
    }

    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        if NAMES.contains(&name) {
            slf.getattr(name)
        } else {
            Err(PyKeyError::new_err(name.to_owned()))
        }
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.t.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let hits: usize = self.hit(py)?.call_method0("sum")?.extract()?;
        Ok(format!("<octray.Hits: {hits} of {} rays>", self.__len__(py)))
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let arrays: Vec<_> =
            NAMES.iter().map(|name| slf.getattr(*name)).collect::<PyResult<_>>()?;
        Ok((slf.get_type().into_any(), PyTuple::new(slf.py(), arrays)?))
    }
}

/// A cell that holds `value` already.
fn filled<T>(py: Python<'_>, value: T) -> PyOnceLock<T> {
    let cell = PyOnceLock::new();
    cell.get_or_init(py, || value);
    cell
}
