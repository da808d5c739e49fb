//! PLY meshes, binary and text, through `serde-ply`.
//!
//! `serde-ply` reads values of the types that the header declares and knows nothing of meshes; where
//! something is wrong it does not say. So `header` looks for the mesh in the header, `rows` takes
//! the values one by one, and `tracked` counts the lines of a text. Positions, faces and the
//! vertices' normals are read; colours, texture coordinates and all else are passed over.

mod header;
mod rows;
mod tracked;

use std::io::{BufRead, ErrorKind, Read};
use std::path::Path;
use std::rc::Rc;

use glam::Vec3;
use serde::de::MapAccess;
use serde_ply::{ElementDef, PlyFormat, PlyReader, PropertyType, ScalarType};

use self::header::{Header, Layout};
use self::rows::{Nobody, Rows, Sink};
use self::tracked::{Track, Tracked};
use super::file::{LoadError, Problem, read as files};
use super::mesh_file::MeshFile;
use crate::geometry::{Mesh, polygon};

/// Reads a file. What is in memory of it at a time is a buffer and the mesh.
pub(crate) fn read(path: &Path) -> Result<MeshFile, LoadError> {
    let (file, bytes) = files::open(path)?;
    parse(file, bytes, path)
}

/// As [`read`] for so many bytes of `from`.
pub(crate) fn parse(from: impl BufRead, bytes: u64, path: &Path) -> Result<MeshFile, LoadError> {
    let mut from = from;
    let header = Header::read(&mut from, path)?;
    let declared = header.parse()?;
    let layout = header.layout(&declared)?;
    let is_text = declared.format == PlyFormat::Ascii;
    let track = is_text.then(|| Rc::new(Track::after(header.lines())));
    let body = Tracked::new(from, track.clone());
    let chained = header.text.as_bytes().chain(body);
    let mut ply = Ply {
        reader: PlyReader::from_reader(chained)
            .map_err(|error| LoadError::new(path, None, Problem::Format(error.0.to_string())))?,
        path,
        track,
    };
    let (vertices, faces) = (&declared.elem_defs[layout.vertex], &declared.elem_defs[layout.face]);
    // A count is a claim: what is set aside for it is no more than the file can hold.
    let most = |element| usize::try_from(bytes / least_bytes(element, is_text)).unwrap_or(0);
    let mut points = Vertices::new(&layout, vertices, most(vertices));
    let mut mesh = Mesh::default();
    let mut thin_faces = 0;
    for (number, element) in declared.elem_defs.iter().enumerate().take(layout.face + 1) {
        if number == layout.vertex {
            ply.element(element, &mut points)?;
            mesh.positions = std::mem::take(&mut points.positions);
            mesh.normals = std::mem::take(&mut points.normals);
        } else if number == layout.face {
            let mut sink = Faces {
                property: layout.corners,
                positions: &mesh.positions,
                corners: Vec::new(),
                triangles: Vec::with_capacity(faces.count.min(most(faces))),
                thin: 0,
            };
            ply.element(element, &mut sink)?;
            (mesh.indices, thin_faces) = (sink.triangles, sink.thin);
        } else {
            ply.element(element, &mut Nobody)?;
        }
    }
    let mut file = MeshFile::of_mesh(mesh);
    if thin_faces > 0 {
        file.warnings.push(format!(
            "{}: faces left out because they have fewer than 3 corners: {thin_faces}",
            path.display()
        ));
    }
    if file.parts[0].mesh.is_empty() {
        let what = "has no faces of 3 corners or more: a mesh needs at least one";
        return Err(LoadError::new(path, None, Problem::Empty(what.into())));
    }
    Ok(file)
}

/// A file after its header.
struct Ply<'a, R> {
    reader: PlyReader<R>,
    path: &'a Path,
    track: Option<Rc<Track>>,
}

impl<R: BufRead> Ply<'_, R> {
    /// Reads the next element.
    fn element(&mut self, element: &ElementDef, sink: &mut impl Sink) -> Result<(), LoadError> {
        let mut rows = Rows {
            sink,
            properties: element.properties.len(),
            track: self.track.as_deref(),
            done: 0,
            property: 0,
            wrong: None,
        };
        let mut reader = &mut self.reader;
        let Err(error) = reader.next_value_seed(&mut rows) else { return Ok(()) };
        let (done, wrong) = (rows.done, rows.wrong);
        let (name, count) = (&element.name, element.count);
        let property = &element.properties[rows.property].name;
        let mut place = self.track.as_ref().map(|track| track.word());
        let problem = match (wrong, error.0.kind()) {
            (Some(what), _) => Problem::Format(format!("`{name}` {done}: {what}")),
            (None, ErrorKind::UnexpectedEof) => {
                place = self.track.as_ref().map(|track| track.next());
                Problem::Format(format!(
                    "the file ends in `{name}` {done} of {count}: it was cut off, or the count is \
                     wrong"
                ))
            }
            (None, ErrorKind::InvalidData) => Problem::Format(format!(
                "`{name}` {done}: `{property}` is not of the type that the header says, {}",
                type_name(&element.properties[rows.property].property_type)
            )),
            (None, _) => Problem::Unreadable(error.0),
        };
        Err(LoadError::new(self.path, place, problem))
    }
}

fn type_name(of: &PropertyType) -> String {
    match of {
        PropertyType::Scalar(number) => number.to_string(),
        PropertyType::List { count_type, data_type } => {
            format!("a list of {data_type} after its length as {count_type}")
        }
    }
}

/// The bytes that a row takes at least.
fn least_bytes(element: &ElementDef, is_text: bool) -> u64 {
    let bytes = |property: &PropertyType| match property {
        _ if is_text => 2,
        PropertyType::Scalar(of) | PropertyType::List { count_type: of, .. } => match of {
            ScalarType::I8 | ScalarType::U8 => 1,
            ScalarType::I16 | ScalarType::U16 => 2,
            ScalarType::I32 | ScalarType::U32 | ScalarType::F32 => 4,
            ScalarType::F64 => 8,
        },
    };
    element.properties.iter().map(|one| bytes(&one.property_type)).sum::<u64>().max(1)
}

/// Takes positions and normals.
struct Vertices {
    /// Where in `row` the value of each property goes.
    slots: Vec<usize>,
    /// x, y, z, the normal, and what is not wanted.
    row: [f32; 7],
    has_normals: bool,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Vertices {
    fn new(layout: &Layout, element: &ElementDef, most: usize) -> Self {
        let mut slots = vec![6; element.properties.len()];
        let wanted = layout.position.iter().chain(layout.normal.iter().flatten());
        for (slot, &property) in wanted.enumerate() {
            slots[property] = slot;
        }
        let count = element.count.min(most);
        let has_normals = layout.normal.is_some();
        let normals = Vec::with_capacity(if has_normals { count } else { 0 });
        Self { slots, row: [0.0; 7], has_normals, positions: Vec::with_capacity(count), normals }
    }
}

impl Sink for Vertices {
    #[inline]
    fn scalar(&mut self, property: usize, value: f64) {
        self.row[self.slots[property]] = value as f32;
    }

    #[inline]
    fn end(&mut self) {
        let [x, y, z, nx, ny, nz, _] = self.row;
        self.positions.push(Vec3::new(x, y, z));
        if self.has_normals {
            self.normals.push(Vec3::new(nx, ny, nz));
        }
    }
}

/// Takes the corners of faces, and cuts them into triangles.
struct Faces<'a> {
    property: usize,
    positions: &'a [Vec3],
    /// Those of the face being read.
    corners: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    thin: usize,
}

impl Sink for Faces<'_> {
    #[inline]
    fn item(&mut self, property: usize, value: f64) -> Result<(), String> {
        if property != self.property {
            return Ok(());
        }
        let count = self.positions.len();
        if !(0.0..count as f64).contains(&value) {
            return Err(format!("vertex {value} is not there: the file has {count}, from 0 on"));
        }
        self.corners.push(value as u32);
        Ok(())
    }

    #[inline]
    fn end(&mut self) {
        match self.corners[..] {
            [] | [_] | [_, _] => self.thin += 1,
            [a, b, c] => self.triangles.push([a, b, c]),
            ref corners => {
                let at = |&corner: &u32| self.positions[corner as usize].as_dvec3();
                let points: Vec<_> = corners.iter().map(at).collect();
                let cut = polygon::triangles(&points);
                self.triangles.extend(cut.iter().map(|of| of.map(|corner| corners[corner])));
            }
        }
        self.corners.clear();
    }
}
