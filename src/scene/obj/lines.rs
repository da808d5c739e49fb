//! The lines of an OBJ file to numbers, with the place of every mistake.
//!
//! A face may name vertices that follow it, and a polygon is cut where its corners are. So the file
//! is read twice: for vertices and normals, then for faces, objects and materials. Texture
//! coordinates, colours, lines and points are left out.

use std::io::Read;

use glam::Vec3;

use super::parts::{Corner, NO_NORMAL, Parts};
use super::text::{Line, Lines};
use crate::geometry::polygon;
use crate::scene::file::LoadError;

/// What the first reading finds.
#[derive(Default)]
pub(super) struct Vertices {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    /// The lines that may hold a face.
    pub(super) faces: usize,
}

impl Vertices {
    /// The vertices and normals of a file.
    ///
    /// # Errors
    /// The place of a number that is none.
    pub(super) fn read<R: Read>(lines: &mut Lines<'_, R>) -> Result<Self, LoadError> {
        let mut found = Self::default();
        while let Some(line) = lines.next()? {
            let mut words = line.words();
            match words.next() {
                Some(b"v") => found.positions.push(position(&line)?),
                Some(b"vn") => {
                    let ([x, y, z, _], _) = numbers(&line)?;
                    found.normals.push(Vec3::new(x, y, z));
                }
                // What is shorter than `f 1 2 3` is no triangle, and nothing is set aside for it.
                Some(b"f") if line.bytes.len() >= 7 => found.faces += 1,
                _ => {}
            }
        }
        Ok(found)
    }
}

/// The first four numbers of a `v` or `vn` line, and how many there are.
#[inline]
fn numbers(line: &Line<'_>) -> Result<([f32; 4], usize), LoadError> {
    let mut numbers = [0.0_f32; 4];
    let mut count = 0;
    for word in line.words().skip(1) {
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        let number = number.ok_or_else(|| {
            line.wrong(word, format!("`{}` is not a number", String::from_utf8_lossy(word)))
        })?;
        if let Some(to) = numbers.get_mut(count) {
            *to = number;
        }
        count += 1;
    }
    if count < 3 {
        let name = line.words().next().unwrap_or_default();
        let shown = String::from_utf8_lossy(name);
        return Err(line.wrong(name, format!("`{shown}` has {count} numbers and needs 3")));
    }
    Ok((numbers, count))
}

#[inline]
fn position(line: &Line<'_>) -> Result<Vec3, LoadError> {
    let ([x, y, z, weight], count) = numbers(line)?;
    let point = Vec3::new(x, y, z);
    // Exactly four numbers are a homogeneous point; more are a point and its colour.
    if count != 4 || weight == 1.0 {
        return Ok(point);
    }
    if weight == 0.0 {
        let start = line.words().next().unwrap_or_default();
        return Err(line.wrong(start, "a vertex with weight 0 is nowhere: give 1".into()));
    }
    Ok(point / weight)
}

/// The second reading, which makes triangles.
pub(super) struct Faces {
    pub(super) parts: Parts,
    /// The vertices and normals so far, from which relative indices count.
    positions: usize,
    normals: usize,
    pub(super) thin: usize,
    corners: Vec<Corner>,
}

impl Faces {
    pub(super) fn new(vertices: Vertices) -> Self {
        let Vertices { positions, normals, faces } = vertices;
        let parts = Parts::new(positions, normals, faces);
        Self { parts, positions: 0, normals: 0, thin: 0, corners: Vec::new() }
    }

    /// Takes a line that is a vertex, a normal or a face; false for any other.
    ///
    /// # Errors
    /// The place of an index that is none or out of range.
    #[inline]
    pub(super) fn take(&mut self, line: &Line<'_>) -> Result<bool, LoadError> {
        match line.words().next() {
            Some(b"v") => self.positions += 1,
            Some(b"vn") => self.normals += 1,
            Some(b"f") => self.face(line)?,
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn face(&mut self, line: &Line<'_>) -> Result<(), LoadError> {
        self.corners.clear();
        for word in line.words().skip(1) {
            let mut fields = word.split(|&byte| byte == b'/');
            let position = fields.next().unwrap_or_default();
            let all = self.parts.positions.len();
            let position = index(line, word, position, "vertex", self.positions, all)?;
            let _texture = fields.next();
            let normal = match fields.next() {
                Some(field) if !field.is_empty() => {
                    let all = self.parts.normals.len();
                    index(line, word, field, "normal", self.normals, all)?
                }
                _ => NO_NORMAL,
            };
            if fields.next().is_some() {
                let word_shown = String::from_utf8_lossy(word);
                let what =
                    format!("`{word_shown}` has too many parts: write v, v/vt, v//vn or v/vt/vn");
                return Err(line.wrong(word, what));
            }
            self.corners.push((position, normal));
        }
        match self.corners[..] {
            [] | [_] | [_, _] => self.thin += 1,
            [a, b, c] => self.parts.triangle([a, b, c]),
            ref corners => {
                let at =
                    |&(position, _): &Corner| self.parts.positions[position as usize].as_dvec3();
                let points: Vec<_> = corners.iter().map(at).collect();
                for triangle in polygon::triangles(&points) {
                    self.parts.triangle(triangle.map(|corner| corners[corner]));
                }
            }
        }
        Ok(())
    }
}

/// An index from 0; in the file it counts from 1, or back from the `before` entries so far.
#[inline]
fn index(
    line: &Line<'_>,
    word: &[u8],
    field: &[u8],
    what: &str,
    before: usize,
    all: usize,
) -> Result<u32, LoadError> {
    let number = match field {
        // Nothing that could overflow.
        [b'0'..=b'9', ..] if field.len() < 10 && field.iter().all(u8::is_ascii_digit) => {
            Some(field.iter().fold(0, |value, digit| value * 10 + i64::from(digit - b'0')))
        }
        _ => std::str::from_utf8(field).ok().and_then(|field| field.parse::<i64>().ok()),
    };
    let Some(number) = number else {
        let field = String::from_utf8_lossy(field);
        let what = format!("`{field}` is not an index: write a whole number from 1");
        return Err(line.wrong(word, what));
    };
    let absolute =
        if number < 0 { number.saturating_add_unsigned(before as u64 + 1) } else { number };
    let in_range = (1..=all as i64).contains(&absolute);
    // The last number stands for no normal.
    let index = u32::try_from(absolute.saturating_sub(1)).ok().filter(|&index| index < NO_NORMAL);
    index.filter(|_| in_range).ok_or_else(|| {
        let message = match number {
            0 => format!("{what} 0: indices count from 1"),
            ..0 => format!("{what} {number} is not there: before this line there are {before}"),
            1.. => format!("{what} {number} is not there: the file has {all}"),
        };
        line.wrong(word, message)
    })
}
