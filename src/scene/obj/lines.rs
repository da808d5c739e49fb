//! The lines of an OBJ file, checked and rewritten.
//!
//! All positions come first, then all normals, then objects, materials and triangles, so the order
//! of the original does not matter. Texture coordinates, colours, lines and points are left out,
//! polygons are cut into triangles, relative indices are made absolute. If some corners have a
//! normal and others none, a first normal of zeros stands for none.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use glam::Vec3;

use crate::geometry::polygon;
use crate::scene::file::{LoadError, Place, Problem};

/// A text that `tobj` reads as it is meant.
pub(super) struct Clean {
    pub(super) text: String,
    /// The materials that faces name.
    pub(super) used: BTreeSet<String>,
    pub(super) warnings: Vec<String>,
}

/// A file being read.
struct Reader<'a> {
    text: &'a str,
    file: &'a Path,
    positions: Vec<Vec3>,
    normals: usize,
    /// The lines of positions and of normals, as they go to `tobj`.
    position_lines: String,
    normal_lines: String,
    rest: String,
    corners: Vec<(u32, u32)>,
    thin_faces: usize,
}

/// Checks and rewrites a whole file.
///
/// # Errors
/// [`LoadError`] with the place of a number that is none, or of an index that is out of range.
pub(super) fn clean(text: &str, file: &Path, with_materials: bool) -> Result<Clean, LoadError> {
    let mut reader = Reader {
        text,
        file,
        positions: Vec::new(),
        normals: 0,
        position_lines: String::with_capacity(text.len() / 2),
        normal_lines: String::new(),
        rest: String::with_capacity(text.len() / 2),
        corners: Vec::new(),
        thin_faces: 0,
    };
    for line in logical_lines(text) {
        reader.vertex(line)?;
    }
    let mut used = BTreeSet::new();
    let (mut positions, mut normals) = (0, 0);
    for line in logical_lines(text) {
        match line.split_whitespace().next() {
            Some("v") => positions += 1,
            Some("vn") => normals += 1,
            Some("f") => reader.face(line, positions, normals)?,
            // An object without a name is one all the same; a material without one is none.
            Some(word @ ("o" | "g")) => reader.name("o", &after(line, word)),
            Some("usemtl") if with_materials && !after(line, "usemtl").is_empty() => {
                let name = after(line, "usemtl");
                reader.name("usemtl", &name);
                used.insert(name);
            }
            Some("mtllib") if with_materials && !after(line, "mtllib").is_empty() => {
                reader.name("mtllib", &after(line, "mtllib").replace('\\', "/"));
            }
            _ => {}
        }
    }
    let mut warnings = Vec::new();
    if reader.thin_faces > 0 {
        let (file, count) = (file.display(), reader.thin_faces);
        warnings.push(format!(
            "{file}: faces left out because they have fewer than 3 corners: {count}"
        ));
    }
    let mut text = reader.position_lines;
    if reader.normals > 0 {
        text.push_str("vn 0 0 0\n");
        text.push_str(&reader.normal_lines);
    }
    text.push_str(&reader.rest);
    Ok(Clean { text, used, warnings })
}

/// Lines, those that end in a backslash with the next one.
fn logical_lines(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let mut end = 0;
        loop {
            let Some(length) = rest[end..].find('\n') else {
                end = rest.len();
                break;
            };
            end += length + 1;
            if !rest[..end].trim_end_matches(['\n', '\r']).ends_with('\\') {
                break;
            }
        }
        let (line, after) = rest.split_at(end);
        rest = after;
        Some(line)
    })
}

/// The words of a line up to a comment, without the backslashes that continue it.
fn words(line: &str) -> impl Iterator<Item = &str> {
    let line = line.split('#').next().unwrap_or_default();
    line.split_whitespace().map(|word| word.trim_end_matches('\\')).filter(|word| !word.is_empty())
}

/// What follows the first word: a name in one line, which may have spaces.
fn after(line: &str, word: &str) -> String {
    let name = line.trim_start()[word.len()..].trim();
    name.replace("\\\r\n", " ").replace("\\\n", " ").replace(['\n', '\r', '\t'], " ")
}

impl Reader<'_> {
    /// An error at a word of the text.
    fn wrong(&self, word: &str, message: String) -> LoadError {
        let offset = word.as_ptr() as usize - self.text.as_ptr() as usize;
        LoadError::new(self.file, Some(Place::of(self.text, offset)), Problem::Format(message))
    }

    /// The numbers of a `v` or `vn` line; other lines are none of its business.
    fn vertex(&mut self, line: &str) -> Result<(), LoadError> {
        let mut words = words(line);
        let Some(name @ ("v" | "vn")) = words.next() else { return Ok(()) };
        let mut numbers = [0.0_f32; 4];
        let mut count = 0;
        for word in words {
            let number =
                word.parse().map_err(|_| self.wrong(word, format!("`{word}` is not a number")))?;
            if let Some(to) = numbers.get_mut(count) {
                *to = number;
            }
            count += 1;
        }
        if count < 3 {
            let start = line.trim_start();
            return Err(self.wrong(start, format!("`{name}` has {count} numbers and needs 3")));
        }
        let [x, y, z, weight] = numbers;
        if name == "vn" {
            self.normals += 1;
            let _ = writeln!(self.normal_lines, "vn {x} {y} {z}");
            return Ok(());
        }
        // Exactly four numbers are a homogeneous point; more are a point and its colour.
        let mut point = Vec3::new(x, y, z);
        if count == 4 && weight != 1.0 {
            if weight == 0.0 {
                let start = line.trim_start();
                return Err(self.wrong(start, "a vertex with weight 0 is nowhere: give 1".into()));
            }
            point /= weight;
        }
        self.positions.push(point);
        let _ = writeln!(self.position_lines, "v {} {} {}", point.x, point.y, point.z);
        Ok(())
    }

    /// A face; so many positions and normals came before it, from which relative indices count.
    fn face(&mut self, line: &str, positions: usize, normals: usize) -> Result<(), LoadError> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for word in words(line).skip(1) {
            let mut fields = word.split('/');
            let position = fields.next().unwrap_or_default();
            let position = self.index(word, position, "vertex", positions, self.positions.len())?;
            let _texture = fields.next();
            let normal = match fields.next() {
                Some(field) if !field.is_empty() => {
                    // The first normal is the one that stands for none.
                    self.index(word, field, "normal", normals, self.normals)? + 1
                }
                _ => 1,
            };
            if fields.next().is_some() {
                let message =
                    format!("`{word}` has too many parts: write v, v/vt, v//vn or v/vt/vn");
                return Err(self.wrong(word, message));
            }
            corners.push((position, normal));
        }
        if corners.len() < 3 {
            self.thin_faces += 1;
        } else {
            self.triangles(&corners);
        }
        self.corners = corners;
        Ok(())
    }

    fn triangles(&mut self, corners: &[(u32, u32)]) {
        let at = |&(position, _): &(u32, u32)| self.positions[position as usize - 1].as_dvec3();
        let points: Vec<_> = corners.iter().map(at).collect();
        for triangle in polygon::triangles(&points) {
            self.rest.push('f');
            for corner in triangle {
                let (position, normal) = corners[corner];
                let _ = match self.normals {
                    0 => write!(self.rest, " {position}"),
                    _ => write!(self.rest, " {position}//{normal}"),
                };
            }
            self.rest.push('\n');
        }
    }

    /// An index from 1, given as such or relative to the `before` entries so far.
    fn index(
        &self,
        word: &str,
        field: &str,
        what: &str,
        before: usize,
        all: usize,
    ) -> Result<u32, LoadError> {
        let Ok(index) = field.parse::<i64>() else {
            let message = format!("`{field}` is not an index: write a whole number from 1");
            return Err(self.wrong(word, message));
        };
        let absolute =
            if index < 0 { index.saturating_add_unsigned(before as u64 + 1) } else { index };
        let in_range = (1..=all as i64).contains(&absolute);
        in_range.then(|| u32::try_from(absolute).ok()).flatten().ok_or_else(|| {
            let message = match index {
                0 => format!("{what} 0: indices count from 1"),
                ..0 => format!("{what} {index} is not there: before this line there are {before}"),
                1.. => format!("{what} {index} is not there: the file has {all}"),
            };
            self.wrong(word, message)
        })
    }

    fn name(&mut self, word: &str, name: &str) {
        let _ = writeln!(self.rest, "{word} {name}");
    }
}
