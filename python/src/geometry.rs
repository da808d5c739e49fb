//! `Mesh`, `Spheres` and `Quads`: what a scene is made of, as read-only float32 copies of the
//! arrays that Python gave.
//!
//! They keep what they were made from, so that a scene can be pickled.

use glam::Vec3;
use numpy::{
    PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{Floats, shape_text};

/// Triangles that share vertices.
///
/// `vertices` has the shape (n, 3) and `faces`, which counts vertices from 0, (m, 3). Without
/// faces, the vertices may have the shape (m, 3, 3): the three corners of each triangle.
#[pyclass(frozen, module = "octray")]
pub(crate) struct Mesh {
    /// The positions, float32, (n, 3), read-only.
    #[pyo3(get)]
    vertices: Py<PyArray2<f32>>,
    /// The vertices of each triangle, uint32, (m, 3), read-only.
    #[pyo3(get)]
    faces: Py<PyArray2<u32>>,
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (vertices, faces=None))]
    pub(crate) fn new(
        vertices: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let py = vertices.py();
        let vertices = Floats::read("vertices", vertices)?;
        let faces = match (faces, vertices.shape()) {
            (Some(faces), [_, 3]) => read_faces(faces)?,
            (None, [triangles, 3, 3]) => {
                let count = u32::try_from(3 * triangles);
                (0..count.map_err(|_| PyValueError::new_err("too many vertices"))?).collect()
            }
            (faces, _) => {
                let shape = vertices.shape_text();
                let right = if faces.is_some() { "(n, 3)" } else { "(m, 3, 3) without faces" };
                let error = format!("vertices has shape {shape}: it must be {right}");
                return Err(PyValueError::new_err(error));
            }
        };
        let vertices = rows_of(py, vertices.to_vec()?)?;
        Ok(Self { vertices, faces: rows_of(py, faces)? })
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.faces.bind(py).shape()[0]
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let vertices = self.vertices.bind(py).shape()[0];
        format!("<octray.Mesh: {} triangles, {vertices} vertices>", self.__len__(py))
    }

    fn __getnewargs__(&self, py: Python<'_>) -> (Py<PyArray2<f32>>, Py<PyArray2<u32>>) {
        (self.vertices.clone_ref(py), self.faces.clone_ref(py))
    }
}

/// Spheres: centres of the shape (n, 3), and n radii above zero, or one for all of them.
#[pyclass(frozen, module = "octray")]
pub(crate) struct Spheres {
    /// The centres, float32, (n, 3), read-only.
    #[pyo3(get)]
    centers: Py<PyArray2<f32>>,
    /// The radii, float32, (n,), read-only.
    #[pyo3(get)]
    radii: Py<PyArray1<f32>>,
}

#[pymethods]
impl Spheres {
    #[new]
    pub(crate) fn new(centers: &Bound<'_, PyAny>, radii: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = centers.py();
        let centers = Floats::read("centers", centers)?;
        let radii = Floats::read("radii", radii)?;
        let count = centers.rows()?;
        let radius = match radii.shape() {
            [] => vec![radii.values()?.get(0); count],
            [len] if *len == count => radii.to_vec()?,
            _ => return Err(centers.mismatch(&radii)),
        };
        let radii = PyArray1::from_vec(py, radius);
        radii.readwrite().make_nonwriteable();
        Ok(Self { centers: rows_of(py, centers.to_vec()?)?, radii: radii.unbind() })
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.radii.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<octray.Spheres: {}>", self.__len__(py))
    }

    fn __getnewargs__(&self, py: Python<'_>) -> (Py<PyArray2<f32>>, Py<PyArray1<f32>>) {
        (self.centers.clone_ref(py), self.radii.clone_ref(py))
    }
}

/// Parallelograms: a corner and the two edges that start there, each of the shape (n, 3).
#[pyclass(frozen, module = "octray")]
pub(crate) struct Quads {
    /// The corners where u = v = 0, float32, (n, 3), read-only.
    #[pyo3(get)]
    corners: Py<PyArray2<f32>>,
    /// The edges along u, float32, (n, 3), read-only.
    #[pyo3(get)]
    edges_u: Py<PyArray2<f32>>,
    /// The edges along v, float32, (n, 3), read-only.
    #[pyo3(get)]
    edges_v: Py<PyArray2<f32>>,
}

#[pymethods]
impl Quads {
    #[new]
    pub(crate) fn new(
        corners: &Bound<'_, PyAny>,
        edges_u: &Bound<'_, PyAny>,
        edges_v: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let py = corners.py();
        let corners = Floats::read("corners", corners)?;
        let edges = [Floats::read("edges_u", edges_u)?, Floats::read("edges_v", edges_v)?];
        for edges in &edges {
            if edges.rows()? != corners.rows()? {
                return Err(corners.mismatch(edges));
            }
        }
        let rows = |array: &Floats<'_>| rows_of(py, array.to_vec()?);
        let [edges_u, edges_v] = &edges;
        Ok(Self { corners: rows(&corners)?, edges_u: rows(edges_u)?, edges_v: rows(edges_v)? })
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.corners.bind(py).shape()[0]
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<octray.Quads: {}>", self.__len__(py))
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, [&self.corners, &self.edges_u, &self.edges_v])
    }
}

/// Any of the three.
#[derive(FromPyObject, IntoPyObjectRef)]
pub(crate) enum Geometry {
    Mesh(Py<Mesh>),
    Spheres(Py<Spheres>),
    Quads(Py<Quads>),
}

impl Geometry {
    /// Reads one item of the list that a scene is made from.
    pub(crate) fn read(item: &Bound<'_, PyAny>) -> PyResult<Self> {
        item.extract().map_err(|_| {
            let kind = item.get_type();
            PyTypeError::new_err(format!("a scene is made of Mesh, Spheres and Quads, not {kind}"))
        })
    }

    /// Adds a copy to a scene under construction.
    pub(crate) fn add_to(&self, py: Python<'_>, scene: &mut octray::SceneBuilder) -> PyResult<()> {
        match self {
            Self::Mesh(mesh) => {
                let (vertices, faces) = (mesh.get().vertices.bind(py), mesh.get().faces.bind(py));
                let mesh = octray::Mesh {
                    positions: points(&vertices.try_readonly()?)?,
                    indices: faces.try_readonly()?.as_slice()?.as_chunks().0.to_vec(),
                    normals: Vec::new(),
                };
                scene.add_mesh(mesh, 0);
            }
            Self::Spheres(spheres) => {
                let [center_x, center_y, center_z] = columns(&spheres.get().centers, py)?;
                let radii: PyReadonlyArray1<'_, f32> =
                    spheres.get().radii.bind(py).try_readonly()?;
                let radius = radii.as_slice()?.to_vec();
                scene.add_spheres(octray::Spheres { center_x, center_y, center_z, radius }, 0);
            }
            Self::Quads(quads) => {
                let [corner_x, corner_y, corner_z] = columns(&quads.get().corners, py)?;
                let [edge_u_x, edge_u_y, edge_u_z] = columns(&quads.get().edges_u, py)?;
                let [edge_v_x, edge_v_y, edge_v_z] = columns(&quads.get().edges_v, py)?;
                let quads = octray::Quads {
                    corner_x,
                    corner_y,
                    corner_z,
                    edge_u_x,
                    edge_u_y,
                    edge_u_z,
                    edge_v_x,
                    edge_v_y,
                    edge_v_z,
                };
                scene.add_quads(quads, 0);
            }
        }
        Ok(())
    }

    /// How many primitives there are.
    pub(crate) fn len(&self, py: Python<'_>) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.get().__len__(py),
            Self::Spheres(spheres) => spheres.get().__len__(py),
            Self::Quads(quads) => quads.get().__len__(py),
        }
    }

    /// The memory of the arrays in bytes.
    pub(crate) fn bytes(&self, py: Python<'_>) -> usize {
        let floats = |array: &Py<PyArray2<f32>>| 4 * array.bind(py).len();
        match self {
            Self::Mesh(mesh) => floats(&mesh.get().vertices) + 4 * mesh.get().faces.bind(py).len(),
            Self::Spheres(spheres) => {
                floats(&spheres.get().centers) + 4 * spheres.get().radii.bind(py).len()
            }
            Self::Quads(quads) => {
                let quads = quads.get();
                floats(&quads.corners) + floats(&quads.edges_u) + floats(&quads.edges_v)
            }
        }
    }
}

/// Vertex numbers of the shape (m, 3), of any type of integers.
fn read_faces(faces: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    let numpy = faces.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (faces,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let is_empty = array.getattr("size")?.extract::<usize>()? == 0;
    if !(is_empty || kind == "i" || kind == "u") {
        let dtype = array.getattr("dtype")?;
        return Err(PyTypeError::new_err(format!("faces has dtype {dtype}: it must be integers")));
    }
    let array = numpy.call_method1("require", (array, "int64", ("C", "A")))?;
    let array = array.cast::<PyArrayDyn<i64>>()?;
    if !matches!(array.shape(), [_, 3]) {
        let shape = shape_text(array.shape());
        return Err(PyValueError::new_err(format!("faces has shape {shape}: it must be (m, 3)")));
    }
    let vertex = |(place, &vertex): (usize, &i64)| {
        u32::try_from(vertex).map_err(|_| {
            let face = place / 3;
            let error = format!("face {face} names vertex {vertex}: indices count from 0");
            PyValueError::new_err(error)
        })
    };
    array.try_readonly()?.as_slice()?.iter().enumerate().map(vertex).collect()
}

/// A read-only NumPy array of the shape (n, 3) that owns `values`.
fn rows_of<T: numpy::Element>(py: Python<'_>, values: Vec<T>) -> PyResult<Py<PyArray2<T>>> {
    let rows = values.len() / 3;
    let array = PyArray1::from_vec(py, values).reshape([rows, 3])?;
    array.readwrite().make_nonwriteable();
    Ok(array.unbind())
}

fn points(rows: &PyReadonlyArray2<'_, f32>) -> PyResult<Vec<Vec3>> {
    Ok(rows.as_slice()?.as_chunks().0.iter().map(|&row| Vec3::from_array(row)).collect())
}

fn columns(rows: &Py<PyArray2<f32>>, py: Python<'_>) -> PyResult<[Vec<f32>; 3]> {
    let rows = rows.bind(py).try_readonly()?;
    let rows = rows.as_slice()?.as_chunks::<3>().0;
    Ok(std::array::from_fn(|axis| rows.iter().map(|row| row[axis]).collect()))
}
