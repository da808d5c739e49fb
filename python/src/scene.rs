//! `Scene`: geometry in a tree, and the queries over it.

use numpy::{PyArray1, PyArray2};
use octray::bvh::PrimKind;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::geometry::{Geometry, Mesh, Quads, Spheres};
use crate::hits::Hits;
use crate::normals::Normals;
use crate::threads::{pool, thread_count};
use crate::trace::Batch;
use crate::visibility::Question;

/// Geometry that rays can be traced against. Immutable; any number of Python threads may use it.
///
/// `geometries` is an iterable of `Mesh`, `Spheres` and `Quads`; `geom_id` counts them from 0.
/// `build` says how much work goes into the tree, 'fast', 'balanced' or 'high'; the answers are
/// the same.
#[pyclass(frozen, module = "octray")]
pub(crate) struct Scene {
    scene: octray::Scene,
    geometries: Vec<Geometry>,
    /// How many primitives each has.
    counts: Vec<usize>,
    normals: Normals,
}

impl Scene {
    /// The normals of hits in a scene without spheres, from their `prim_id` and `geom_id`.
    pub(crate) fn flat_normals<'py>(
        &self,
        py: Python<'py>,
        hits: (&[i32], &[i32]),
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.normals.of_hits(py, &self.scene, &self.counts, hits, threads)
    }

    fn build(py: Python<'_>, geometries: Vec<Geometry>, build: &str) -> PyResult<Self> {
        let quality = build.parse::<octray::BuildQuality>();
        let quality = quality.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let mut scene = octray::SceneBuilder::new();
        scene.set_quality(quality);
        for geometry in &geometries {
            geometry.add_to(py, &mut scene)?;
        }
        let pool = pool(py)?;
        let scene = py.detach(|| pool.install(|| scene.build()));
        let scene = scene.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let counts = geometries.iter().map(|geometry| geometry.len(py)).collect();
        Ok(Self { scene, geometries, counts, normals: Normals::default() })
    }

    fn count(&self, kind: PrimKind) -> usize {
        self.scene.primitive_count(kind)
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (geometries, *, build="balanced"))]
    fn new(geometries: &Bound<'_, PyAny>, build: &str) -> PyResult<Self> {
        let items = geometries.try_iter()?;
        let read = items.map(|item| Geometry::read(&item?)).collect::<PyResult<_>>()?;
        Self::build(geometries.py(), read, build)
    }

    /// The scene of one mesh: see `Mesh`.
    #[staticmethod]
    #[pyo3(signature = (vertices, faces=None, *, build="balanced"))]
    fn from_mesh(
        vertices: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
        build: &str,
    ) -> PyResult<Self> {
        let py = vertices.py();
        let mesh = Mesh::new(vertices, faces)?;
        Self::build(py, vec![Geometry::Mesh(Py::new(py, mesh)?)], build)
    }

    /// The scene of these spheres: see `Spheres`.
    #[staticmethod]
    #[pyo3(signature = (centers, radii, *, build="balanced"))]
    fn from_spheres(
        centers: &Bound<'_, PyAny>,
        radii: &Bound<'_, PyAny>,
        build: &str,
    ) -> PyResult<Self> {
        let py = centers.py();
        let spheres = Spheres::new(centers, radii)?;
        Self::build(py, vec![Geometry::Spheres(Py::new(py, spheres)?)], build)
    }

    /// The scene of these parallelograms: see `Quads`.
    #[staticmethod]
    #[pyo3(signature = (corners, edges_u, edges_v, *, build="balanced"))]
    fn from_quads(
        corners: &Bound<'_, PyAny>,
        edges_u: &Bound<'_, PyAny>,
        edges_v: &Bound<'_, PyAny>,
        build: &str,
    ) -> PyResult<Self> {
        let py = corners.py();
        let quads = Quads::new(corners, edges_u, edges_v)?;
        Self::build(py, vec![Geometry::Quads(Py::new(py, quads)?)], build)
    }

    /// The closest hit of each ray, the points origin + t * direction with t_min <= t <= t_max.
    ///
    /// origins and directions have the shape (n, 3), or are one row for all rays; directions need
    /// not be of unit length. t_min and t_max are one number or have the shape (n,). threads is 0
    /// or -1 for all cores, or the most to use. Of hits at one t the one with the smallest
    /// (geom_id, prim_id) counts; the result is the same for every number of threads. A ray with a
    /// NaN, an infinite origin or direction, a direction of zero or t_min > t_max hits nothing.
    #[pyo3(signature = (origins, directions, t_min=None, t_max=None, threads=0),
        text_signature = "($self, origins, directions, t_min=0, t_max=inf, threads=0)")]
    fn intersect(
        slf: &Bound<'_, Self>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        t_min: Option<&Bound<'_, PyAny>>,
        t_max: Option<&Bound<'_, PyAny>>,
        threads: i64,
    ) -> PyResult<Hits> {
        let (py, scene) = (slf.py(), slf.get());
        let threads = thread_count(py, threads)?;
        let batch = Batch::read(origins, directions, t_min, t_max)?;
        // The normal of a sphere depends on the ray, whose arrays may change before it is asked
        // for.
        let with_normals = scene.count(PrimKind::Sphere) > 0;
        let (arrays, normal) = batch.intersect(py, &scene.scene, threads, with_normals)?;
        Ok(Hits::of(py, arrays, normal, slf.clone().unbind(), threads))
    }

    /// Whether each ray hits anything: a bool array of the shape (n,). Takes what `intersect`
    /// takes.
    #[pyo3(signature = (origins, directions, t_min=None, t_max=None, threads=0),
        text_signature = "($self, origins, directions, t_min=0, t_max=inf, threads=0)")]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: Option<&Bound<'py, PyAny>>,
        t_max: Option<&Bound<'py, PyAny>>,
        threads: i64,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let threads = thread_count(py, threads)?;
        Batch::read(origins, directions, t_min, t_max)?.occluded(py, &self.scene, threads)
    }

    /// The fraction of a light that each point sees: float32, (n,).
    ///
    /// points has the shape (n, 3) and lies off the surfaces. light is a point, (3,), or a corner and
    /// two edges of a parallelogram, (3, 3). samples says how many points of the light each point
    /// looks at, in stratified sets that follow from the point's number and seed; or it is an array
    /// (n, s, 2) of places along the edges, from 0 to 1. With normals, (n, 3), samples behind the
    /// surface are not seen. A sample is seen exactly if `occluded` is false for the ray from the
    /// point to it, t from 0 to 1 - 1e-4.
    #[pyo3(signature = (points, light, samples=None, normals=None, seed=0, threads=0),
        text_signature = "($self, points, light, samples=16, normals=None, seed=0, threads=0)")]
    #[allow(clippy::too_many_arguments)]
    fn visibility<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        light: &Bound<'py, PyAny>,
        samples: Option<&Bound<'py, PyAny>>,
        normals: Option<&Bound<'py, PyAny>>,
        seed: u64,
        threads: i64,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let threads = thread_count(py, threads)?;
        let question = Question::read(points, light, samples, normals, seed)?;
        question.fractions(py, &self.scene, threads)
    }

    /// What the scene was made of, in the order of geom_id.
    #[getter]
    fn geometries<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, &self.geometries)
    }

    /// The corners of the box around everything: float32, (2, 3). An empty scene has inf in the
    /// first row and -inf in the second.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let bounds = self.scene.bounds();
        let corners = [bounds.min.to_array(), bounds.max.to_array()];
        use numpy::PyArrayMethods;
        PyArray1::from_slice(py, corners.as_flattened()).reshape([2, 3])
    }

    /// How many triangles no ray can hit: those without area and those with a corner that is not
    /// finite. They keep their prim_id.
    #[getter]
    fn dropped<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dropped = self.scene.dropped();
        let counts = PyDict::new(py);
        counts.set_item("degenerate", dropped.degenerate)?;
        counts.set_item("not_finite", dropped.not_finite)?;
        Ok(counts)
    }

    /// The memory of the scene in bytes, `geometries` and normals that are kept included.
    #[getter]
    fn nbytes(&self, py: Python<'_>) -> usize {
        let inputs = self.geometries.iter().map(|geometry| geometry.bytes(py));
        self.scene.bytes() + self.normals.bytes() + inputs.sum::<usize>()
    }

    fn __len__(&self) -> usize {
        [PrimKind::Triangle, PrimKind::Quad, PrimKind::Sphere]
            .map(|kind| self.count(kind))
            .iter()
            .sum()
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let mut parts = vec![match self.scene.geometry_count() {
            1 => "1 geometry".to_owned(),
            count => format!("{count} geometries"),
        }];
        let kinds = [
            ("triangles", PrimKind::Triangle),
            ("quads", PrimKind::Quad),
            ("spheres", PrimKind::Sphere),
        ];
        let counts = kinds.map(|(name, kind)| (name, self.count(kind)));
        let counts = counts.iter().filter(|(_, count)| *count > 0);
        parts.extend(counts.map(|(name, count)| format!("{count} {name}")));
        parts.push(format!("{:.1} MB", self.nbytes(py) as f64 / 1e6));
        format!("<octray.Scene: {}>", parts.join(", "))
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyList>,)> {
        Ok((self.geometries(py)?,))
    }
}
