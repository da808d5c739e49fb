//! OBJ meshes, and their MTL materials through `tobj`.
//!
//! `text` cuts a file into lines, `lines` makes numbers of them and finds every mistake with its
//! place, `parts` makes meshes of the triangles. A file is read twice and never held: in memory are
//! the positions and the meshes. `tobj` says little about what is wrong with a file, and panics or
//! wraps around on some, so it gets materials alone, which `mtl` has gone through before.

mod lines;
mod mtl;
mod parts;
mod text;

use std::collections::{BTreeSet, HashMap};
use std::io::Read;
use std::path::Path;

use self::lines::{Faces, Vertices};
use self::text::Lines;
use super::file::{LoadError, Problem, read as files};
use super::mesh_file::MeshFile;

/// Reads a file. Without `with_materials` it is split by objects alone and no MTL file is opened.
pub(crate) fn read(path: &Path, with_materials: bool) -> Result<MeshFile, LoadError> {
    parse(|| Ok(files::open(path)?.0), path, with_materials)
}

/// As [`read`] for the text that `open` gives, each time from its beginning. MTL files are looked
/// for beside `path`.
pub(crate) fn parse<R: Read>(
    open: impl Fn() -> Result<R, LoadError>,
    path: &Path,
    with_materials: bool,
) -> Result<MeshFile, LoadError> {
    let vertices = Vertices::read(&mut Lines::new(open()?, path))?;
    let mut faces = Faces::new(vertices);
    let mut materials = Materials { folder: path.parent(), ..Materials::default() };
    let mut material = None;
    let mut lines = Lines::new(open()?, path);
    while let Some(line) = lines.next()? {
        if faces.take(&line)? {
            continue;
        }
        let name = |keyword| line.name_after(keyword).filter(|name| !name.is_empty());
        // An object without a name is one all the same; a material without one is none.
        if line.name_after("o").or_else(|| line.name_after("g")).is_some() {
            faces.parts.end(material);
        } else if let (true, Some(name)) = (with_materials, name("usemtl")) {
            let new = materials.use_named(name);
            if new != material {
                faces.parts.end(material);
            }
            material = new;
        } else if let (true, Some(name)) = (with_materials, name("mtllib")) {
            materials.read(&name.replace('\\', "/"));
        }
    }
    faces.parts.end(material);
    let mut file = MeshFile::default();
    if faces.thin > 0 {
        let (path, count) = (path.display(), faces.thin);
        file.warnings.push(format!(
            "{path}: faces left out because they have fewer than 3 corners: {count}"
        ));
    }
    materials.finish(path, &mut file);
    file.parts = faces.parts.finish();
    if file.parts.is_empty() {
        let message = "has no faces: a mesh needs at least one `f` line".into();
        return Err(LoadError::new(path, None, Problem::Empty(message)));
    }
    Ok(file)
}

/// The materials of the MTL files so far.
#[derive(Default)]
struct Materials<'a> {
    folder: Option<&'a Path>,
    all: Vec<tobj::Material>,
    /// The last one of each name.
    by_name: HashMap<String, usize>,
    /// Those that faces name.
    used: BTreeSet<String>,
    warnings: Vec<String>,
}

impl Materials<'_> {
    fn use_named(&mut self, name: String) -> Option<usize> {
        let found = self.by_name.get(&name).copied();
        self.used.insert(name);
        found
    }

    fn read(&mut self, name: &str) {
        let path = self.folder.unwrap_or(Path::new("")).join(name);
        // `mtl` leaves nothing in it that `tobj` refuses.
        let (materials, names) = mtl::read(&path, &mut self.warnings).unwrap_or_default();
        let before = self.all.len();
        self.all.extend(materials);
        self.by_name.extend(names.into_iter().map(|(name, index)| (name, before + index)));
    }

    fn finish(mut self, path: &Path, file: &mut MeshFile) {
        file.warnings.append(&mut self.warnings);
        let unknown: Vec<_> =
            self.used.into_iter().filter(|name| !self.by_name.contains_key(name)).collect();
        if let [first, others @ ..] = &unknown[..] {
            let others = match others.len() {
                0 => String::new(),
                count => format!(" (and {count} more)"),
            };
            file.warnings.push(format!(
                "{}: its MTL files have no material `{first}`{others}: such faces get the default \
                 one",
                path.display()
            ));
        }
        file.materials =
            self.all.iter().map(|one| mtl::material(one, &mut file.warnings)).collect();
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn read(text: &str) -> MeshFile {
        parse(|| Ok(text.as_bytes()), Path::new("a.obj"), true).unwrap()
    }

    /// A strip of squares in several objects and materials, each corner with one of two normals.
    fn strip(squares: usize) -> String {
        let mut text = String::from("vn 0 0 1\nvn 0 1 1\n");
        for at in 0..=squares {
            text += &format!("v {at} 0 0.1\nv {at} 1 {}\n", at as f32 / 7.0);
        }
        for at in 0..squares {
            let (a, b) = (2 * at + 1, 2 * at + 2);
            if at % 10 == 3 {
                text += &format!("o part {at}\n");
            }
            let normal = 1 + at % 2;
            text += &format!("f {a}//{normal} {}//1 {b}//2\n", a + 2);
            text += &format!("f {}//1 {}//{normal} {b}//2\n", a + 2, b + 2);
        }
        text
    }

    #[test]
    fn parts_are_those_of_tobj() {
        // More than a block of the file, so lines lie across its border.
        let text = strip(9_000);
        assert!(text.len() > 1 << 19);
        let options = tobj::LoadOptions { single_index: true, ..Default::default() };
        let (models, _) =
            tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Err(tobj::LoadError::ReadError))
                .unwrap();
        let parts = read(&text).parts;
        assert_eq!(parts.len(), models.len());
        assert!(parts.len() > 500);
        let points = |flat: &[f32]| flat.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
        for (part, model) in parts.iter().zip(&models) {
            assert_eq!(part.mesh.positions, points(&model.mesh.positions));
            assert_eq!(part.mesh.normals, points(&model.mesh.normals));
            assert_eq!(part.mesh.indices.as_flattened(), model.mesh.indices);
        }
    }

    #[test]
    fn lines_longer_than_a_block_are_one() {
        let long = "# ".to_owned() + &"x".repeat(1 << 20);
        let text =
            format!("v 0 0 0 {long}\nv 1 0 0\nv 0 1 0\n{long}\nf 1 2{} 34", " ".repeat(1 << 19));
        let error = parse(|| Ok(text.as_bytes()), Path::new("a.obj"), true).unwrap_err();
        assert!(error.to_string().starts_with("a.obj:5:524295: vertex 34"), "{error}");
    }
}
