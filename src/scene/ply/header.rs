//! The header of a PLY file: what its elements are called and made of, and whether that is a mesh.

use std::io::{BufRead, Read};
use std::path::Path;

use serde_ply::{ElementDef, PlyHeader, PlyReader, PropertyType, ScalarType};

use crate::scene::file::{LoadError, Place, Problem};

/// A header of more bytes than this is none.
const MOST_BYTES: usize = 1 << 16;

/// The text of a header, which ends with its line `end_header`.
pub(super) struct Header<'a> {
    file: &'a Path,
    pub(super) text: String,
}

/// Where a mesh is in the file.
pub(super) struct Layout {
    /// The number of the element `vertex` and that of `face`.
    pub(super) vertex: usize,
    pub(super) face: usize,
    /// The properties x, y, z, and the normal's if it has all of them.
    pub(super) position: [usize; 3],
    pub(super) normal: Option<[usize; 3]>,
    /// The property with the corners of a face.
    pub(super) corners: usize,
}

impl<'a> Header<'a> {
    /// Reads up to the end of the header.
    pub(super) fn read(from: &mut impl BufRead, file: &'a Path) -> Result<Self, LoadError> {
        let fail = |place, problem| Err(LoadError::new(file, place, problem));
        let mut bytes = Vec::new();
        let mut start = 0;
        while start == 0 || bytes[start..].trim_ascii() != b"end_header" {
            start = bytes.len();
            let left = (MOST_BYTES - start) as u64;
            from.take(left)
                .read_until(b'\n', &mut bytes)
                .map_err(|error| LoadError::new(file, None, Problem::Unreadable(error)))?;
            if start == 0 && bytes.is_empty() {
                let what = "is empty: a PLY file begins with a line `ply`";
                return fail(None, Problem::Empty(what.into()));
            }
            if start == 0 && bytes.trim_ascii() != b"ply" {
                let what = "is no PLY file: its first line must be `ply`";
                return fail(None, Problem::Kind(what.into()));
            }
            // The data begin after a line end, so a header without one is cut off.
            if !bytes[start..].ends_with(b"\n") {
                let what = "the header does not end: write `end_header` and a line end after it";
                let line = bytes.iter().filter(|&&byte| byte == b'\n').count() + 1;
                return fail(Some(Place { line, column: 1 }), Problem::Format(what.into()));
            }
        }
        // Comments in old encodings are no reason to refuse a mesh.
        Ok(Self { file, text: String::from_utf8_lossy(&bytes).into_owned() })
    }

    /// How many lines it has.
    pub(super) fn lines(&self) -> usize {
        self.text.lines().count()
    }

    /// What the lines say.
    pub(super) fn parse(&self) -> Result<PlyHeader, LoadError> {
        let mut rest = self.text.as_bytes();
        match PlyReader::from_reader(&mut rest) {
            Ok(reader) => Ok(reader.header().clone()),
            Err(error) => {
                // It stops after the line that it does not understand.
                let read = self.text.len() - rest.len();
                let last = self.text[..read].trim_end().len();
                let line = Place::of(&self.text, last).line;
                let what = format!("{}: see the PLY format", error.0);
                Err(self.wrong(line, what))
            }
        }
    }

    /// Finds the mesh.
    pub(super) fn layout(&self, header: &PlyHeader) -> Result<Layout, LoadError> {
        let vertex = self.element(header, "vertex")?.ok_or_else(|| {
            let what = "the header has no `element vertex`: a mesh needs one with x, y and z";
            LoadError::new(self.file, None, Problem::Format(what.into()))
        })?;
        let faces = self.element(header, "face")?;
        let Some(face) = faces.filter(|&face| header.elem_defs[face].count > 0) else {
            let what = "has no faces: a mesh needs an `element face`; points alone and triangle \
                        strips are not read";
            return Err(LoadError::new(self.file, None, Problem::Empty(what.into())));
        };
        if face < vertex {
            let what = "`face` comes before `vertex`: write the vertices first";
            return Err(self.wrong(self.line_of("face"), what.into()));
        }
        for (name, element) in [("vertex", vertex), ("face", face)] {
            let count = header.elem_defs[element].count;
            if u32::try_from(count).is_err() {
                let what = format!("{count} are too many: a mesh has at most {}", u32::MAX);
                return Err(self.wrong(self.line_of(name), what));
            }
        }
        let vertices = &header.elem_defs[vertex];
        let mut position = [0; 3];
        for (to, name) in position.iter_mut().zip(["x", "y", "z"]) {
            *to = self.property(vertices, &[name], is_number)?.ok_or_else(|| {
                let what = format!("`vertex` has no number `{name}`: a mesh needs x, y and z");
                self.wrong(self.line_of("vertex"), what)
            })?;
        }
        let mut normal = Some([0; 3]);
        for (axis, name) in ["nx", "ny", "nz"].into_iter().enumerate() {
            let found = self.property(vertices, &[name], is_number)?;
            normal = normal.zip(found).map(|(mut normal, found)| {
                normal[axis] = found;
                normal
            });
        }
        let names = ["vertex_indices", "vertex_index"];
        let corners =
            self.property(&header.elem_defs[face], &names, is_index_list)?.ok_or_else(|| {
                let what = "`face` has no list of whole numbers `vertex_indices`: write `property \
                            list uchar int vertex_indices`";
                self.wrong(self.line_of("face"), what.into())
            })?;
        Ok(Layout { vertex, face, position, normal, corners })
    }

    /// The one element of this name.
    fn element(&self, header: &PlyHeader, name: &str) -> Result<Option<usize>, LoadError> {
        let mut all = header.elem_defs.iter().enumerate().filter(|(_, one)| one.name == name);
        let first = all.next().map(|(number, _)| number);
        if all.next().is_some() {
            let what = format!("there is more than one `element {name}`: join them");
            return Err(self.wrong(self.line_of(name), what));
        }
        Ok(first)
    }

    /// The one property of an element that has any of these names and a type that will do.
    fn property(
        &self,
        element: &ElementDef,
        names: &[&str],
        fits: fn(&PropertyType) -> bool,
    ) -> Result<Option<usize>, LoadError> {
        let is_it = |number: &usize| names.contains(&&*element.properties[*number].name);
        let mut all = (0..element.properties.len()).filter(is_it);
        let first = all.next().filter(|&at| fits(&element.properties[at].property_type));
        if all.next().is_some() {
            let what = format!("`{}` has more than one `{}`", element.name, names[0]);
            return Err(self.wrong(self.line_of(&element.name), what + ": rename the others"));
        }
        Ok(first)
    }

    /// The line of an element.
    fn line_of(&self, element: &str) -> usize {
        let is_it = |line: &str| {
            let mut words = line.split_whitespace();
            words.next() == Some("element") && words.next() == Some(element)
        };
        self.text.lines().position(is_it).map_or(1, |index| index + 1)
    }

    fn wrong(&self, line: usize, what: String) -> LoadError {
        LoadError::new(self.file, Some(Place { line, column: 1 }), Problem::Format(what))
    }
}

fn is_number(property: &PropertyType) -> bool {
    matches!(property, PropertyType::Scalar(_))
}

fn is_index_list(property: &PropertyType) -> bool {
    match property {
        PropertyType::Scalar(_) => false,
        PropertyType::List { count_type, data_type } => [count_type, data_type]
            .iter()
            .all(|of| !matches!(of, ScalarType::F32 | ScalarType::F64)),
    }
}
