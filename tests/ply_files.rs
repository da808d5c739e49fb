//! PLY files: all encodings are the same mesh as the OBJ of it, and what is wrong with one is one
//! message with its place.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use glam::Vec3;
use octray::bvh::PrimKind;
use octray::scene::{load_obj, load_ply};
use octray::{Hit, Loaded, Ray, load};

#[derive(Clone, Copy)]
enum Encoding {
    Text,
    Little,
    Big,
}

const ENCODINGS: [(Encoding, &str); 3] = [
    (Encoding::Text, "ascii"),
    (Encoding::Little, "binary_little_endian"),
    (Encoding::Big, "binary_big_endian"),
];

/// Bytes of a body.
struct Body {
    encoding: Encoding,
    bytes: Vec<u8>,
}

macro_rules! put {
    ($($name:ident $number:ty),*) => {$(
        fn $name(&mut self, value: $number) {
            match self.encoding {
                Encoding::Text => self.bytes.extend_from_slice(format!("{value} ").as_bytes()),
                Encoding::Little => self.bytes.extend_from_slice(&value.to_le_bytes()),
                Encoding::Big => self.bytes.extend_from_slice(&value.to_be_bytes()),
            }
        }
    )*};
}

impl Body {
    put!(u8 u8, i16 i16, u32 u32, f32 f32, f64 f64);

    fn end(&mut self) {
        if matches!(self.encoding, Encoding::Text) {
            self.bytes.push(b'\n');
        }
    }
}

/// A house with a concave front, a quad and a triangle, and much around it that nobody asked for.
const POINTS: [[f32; 3]; 7] = [
    [0.0, 0.0, 0.0],
    [4.0, 0.0, 0.5],
    [4.0, 3.0, 0.0],
    [2.0, 1.25, 0.0],
    [0.0, 3.0, 0.25],
    [6.0, 0.0, -1.0],
    [6.0, 3.0, -1.5],
];
const FACES: [&[u32]; 4] = [&[0, 1, 2, 3, 4], &[1, 5, 6, 2], &[0, 1, 5], &[6, 2]];

fn house(encoding: Encoding, name: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat {name} 1.0\ncomment a house\nobj_info of 7 points\n\
         element camera 2\nproperty double zoom\nproperty list uchar short marks\n\
         element nothing 1000000000000000000\n\
         element vertex {}\nproperty uchar red\nproperty float x\nproperty float32 y\n\
         property double z\nproperty list uint8 float64 uv\n\
         element face {}\nproperty list uchar uint32 vertex_index\nproperty int16 group\n\
         element edge 99\nproperty int a\nend_header\n",
        POINTS.len(),
        FACES.len()
    );
    let mut body = Body { encoding, bytes: header.into_bytes() };
    for marks in [0, 3] {
        body.f64(0.5);
        body.u8(marks);
        (0..marks).for_each(|mark| body.i16(-i16::from(mark)));
        body.end();
    }
    for [x, y, z] in POINTS {
        body.u8(255);
        body.f32(x);
        body.f32(y);
        body.f64(f64::from(z));
        body.u8(2);
        body.f64(1e300);
        body.f64(-0.1);
        body.end();
    }
    for face in FACES {
        body.u8(face.len() as u8);
        face.iter().for_each(|&corner| body.u32(corner));
        body.i16(-7);
        body.end();
    }
    body.bytes
}

fn parse(bytes: &[u8]) -> Result<Loaded, String> {
    load_ply(bytes, Path::new("a.ply")).map_err(|error| error.to_string())
}

/// What rays from in front of the mesh meet.
fn seen(loaded: &Loaded) -> Vec<Option<Hit>> {
    let points = (0..40).flat_map(|y| (0..80).map(move |x| (x as f32, y as f32)));
    let at = |(x, y)| Vec3::new(x * 0.08 - 0.1, y * 0.08 - 0.1, 5.0);
    points.map(|point| loaded.scene.intersect(&Ray::new(at(point), Vec3::NEG_Z))).collect()
}

#[test]
fn all_encodings_are_the_mesh_that_the_obj_is() {
    let mut obj = String::new();
    for [x, y, z] in POINTS {
        let _ = writeln!(obj, "v {x} {y} {z}");
    }
    for face in FACES {
        obj.push('f');
        for corner in face {
            let _ = write!(obj, " {}", corner + 1);
        }
        obj.push('\n');
    }
    let expected = seen(&load_obj(obj.as_bytes(), Path::new("a.obj")).unwrap());
    assert!(expected.iter().flatten().count() > 1000);
    for (encoding, name) in ENCODINGS {
        let loaded = parse(&house(encoding, name)).unwrap();
        assert!(seen(&loaded) == expected, "{name}");
        assert_eq!(loaded.scene.primitive_count(PrimKind::Triangle), 6);
        let thin = "a.ply: faces left out because they have fewer than 3 corners: 1";
        assert_eq!(loaded.warnings, [thin]);
    }
}

/// However far a file was written, it is a mesh or told to be cut off.
#[test]
fn a_file_cut_anywhere_is_an_error() {
    for (encoding, name) in ENCODINGS {
        let bytes = house(encoding, name);
        // Neither the line end after the last number nor what follows the faces is needed.
        let whole = bytes.len() - usize::from(matches!(encoding, Encoding::Text)) * 2;
        for end in 0..=bytes.len() {
            match parse(&bytes[..end]) {
                Ok(_) => assert!(end >= whole - 1, "{name}: {end} of {}", bytes.len()),
                Err(message) => {
                    assert!(end < whole, "{name}: {end}: {message}");
                    assert!(message.starts_with("a.ply") && !message.contains('\n'), "{message}");
                }
            }
        }
    }
}

/// A file of one triangle, `old` replaced by `new`.
fn altered(old: &str, new: &str) -> Result<Loaded, String> {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert!(text.contains(old), "{old}");
    parse(text.replacen(old, new, 1).as_bytes())
}

#[test]
fn what_is_wrong_has_a_place_and_a_mend() {
    for (old, new, message) in [
        ("ply\n", "plx\n", ": is no PLY file: its first line must be `ply`"),
        (
            "end_header\n",
            "",
            ":13:1: the header does not end: write `end_header` and a line end after it",
        ),
        ("format ascii", "format utf8", ":2:1: Unknown format: utf8: see the PLY format"),
        ("float y", "long y", ":5:1: Unknown scalar type: long: see the PLY format"),
        ("vertex 3", "vertex -3", ":3:1: Invalid element count: -3: see the PLY format"),
        ("format ascii 1.0\n", "", ":8:1: Missing format specification: see the PLY format"),
        (
            "element vertex",
            "element point",
            ": the header has no `element vertex`: a mesh needs one with x, y and z",
        ),
        (
            "element face 1",
            "element face 0",
            ": has no faces: a mesh needs an `element face`; points alone and triangle strips are not read",
        ),
        (
            "element face",
            "element vertex",
            ":3:1: there is more than one `element vertex`: join them",
        ),
        (
            "vertex 3\n",
            "vertex 4294967296\n",
            ":3:1: 4294967296 are too many: a mesh has at most 4294967295",
        ),
        ("float z", "float w", ":3:1: `vertex` has no number `z`: a mesh needs x, y and z"),
        (
            "property float z",
            "property list uchar float z",
            ":3:1: `vertex` has no number `z`: a mesh needs x, y and z",
        ),
        ("float z", "float x", ":3:1: `vertex` has more than one `x`: rename the others"),
        (
            "vertex_indices",
            "corners",
            ":7:1: `face` has no list of whole numbers `vertex_indices`: write `property list uchar int vertex_indices`",
        ),
        (
            "uchar int",
            "uchar float",
            ":7:1: `face` has no list of whole numbers `vertex_indices`: write `property list uchar int vertex_indices`",
        ),
        (
            "1 0 0",
            "1 o 0",
            ":11:3: `vertex` 1: `y` is not of the type that the header says, float32",
        ),
        ("1 0 0", "1 0", ":12:1: `vertex` 1: line 11 ends before its 3 properties"),
        ("1 0 0", "1 0 0 0", ":11:7: `vertex` 2: the line has more than its 3 properties"),
        ("3 0 1 2", "3 0 1 3", ":13:7: `face` 0: vertex 3 is not there: the file has 3, from 0 on"),
        (
            "3 0 1 2",
            "3 0 -1 2",
            ":13:5: `face` 0: vertex -1 is not there: the file has 3, from 0 on",
        ),
        (
            "3 0 1 2",
            "3 0 1",
            ":14:1: the file ends in `face` 0 of 1: it was cut off, or the count is wrong",
        ),
        (
            "3 0 1 2",
            "-3 0 1 2",
            ":13:1: `face` 0: `vertex_indices` is not of the type that the header says, a list of int32 after its length as uint8",
        ),
        ("3 0 1 2", "2 0 1", ": has no faces of 3 corners or more: a mesh needs at least one"),
        (
            "1 0 0",
            "nan 0 0",
            ": all triangles are without area or not finite: there is nothing to see",
        ),
    ] {
        assert_eq!(altered(old, new).expect_err(new), format!("a.ply{message}"), "{old} -> {new}");
    }
    assert!(parse(b"").unwrap_err().starts_with("a.ply: is empty"));
    let backwards = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n\
                     element vertex 1\nproperty int x\nproperty int y\nproperty int z\nend_header\n";
    let message = parse(backwards.as_bytes()).unwrap_err();
    assert_eq!(message, "a.ply:3:1: `face` comes before `vertex`: write the vertices first");
}

#[test]
fn odd_texts_are_read() {
    for (old, new) in [
        ("3 0 1 2\n", "3 0 1 2"),
        ("1 0 0\n", "\n \t+1e0   .0 0. \r\n"),
        ("ascii 1.0\n", "ascii 1.0 \r\n"),
        ("end_header\n", "end_header\r\n"),
        ("vertex_indices", "vertex_index"),
    ] {
        altered(old, new).unwrap_or_else(|message| panic!("{new:?}: {message}"));
    }
    let mut latin = b"ply\ncomment caf\xe9\n".to_vec();
    let (encoding, name) = ENCODINGS[1];
    latin.extend_from_slice(&house(encoding, name)[4..]);
    parse(&latin).unwrap();
}

/// Counts that no file could hold, at once and without the memory that they ask for.
#[test]
fn huge_counts_are_refused() {
    let header = |vertices: &str, list: &str, faces: &str| {
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty char x\n\
             property char y\nproperty char z\nelement face {faces}\n\
             property list {list} uint vertex_indices\nend_header\n"
        )
        .into_bytes()
    };
    for (vertices, list, faces, message) in [
        ("1000000000000000000", "uchar", "1", ":3:1: 1000000000000000000 are too many"),
        ("99999999999999999999", "uchar", "1", ":3:1: Invalid element count"),
        ("4294967295", "uchar", "1", ": the file ends in `vertex` 333 of 4294967295"),
        ("1", "uchar", "4294967295", ": the file ends in `face` 997 of 4294967295"),
        ("300", "uint", "1", ": `face` 0: vertex 4294967295 is not there"),
    ] {
        let mut bytes = header(vertices, list, faces);
        let filler = if list == "uint" { 255 } else { 0 };
        bytes.extend_from_slice(&[filler; 1000]);
        let error = parse(&bytes).expect_err(message);
        assert!(error.starts_with(&format!("a.ply{message}")), "{error}");
    }
}

#[test]
fn normals_at_the_vertices_are_kept() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nproperty float nz\nproperty float nx\nproperty float ny\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 0 2 2 0\n1 0 0 2 2 0\n0 1 0 2 2 0\n3 0 1 2\n";
    let normal = |text: &str| {
        let loaded = parse(text.as_bytes()).unwrap();
        let ray = Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z);
        let hit = loaded.scene.intersect(&ray).unwrap();
        loaded.scene.surface(&ray, &hit).shading_normal
    };
    assert!(normal(text).distance(Vec3::new(1.0, 0.0, 1.0).normalize()) < 1e-6);
    assert_eq!(normal(&text.replace("float ny", "float n")), Vec3::Z, "not all of it is there");
}

#[test]
fn scenes_and_the_command_line_take_them() {
    let folder = tempfile::tempdir().unwrap();
    let (encoding, name) = ENCODINGS[2];
    let mesh = folder.path().join("house.PLY");
    fs::write(&mesh, house(encoding, name)).unwrap();
    let alone = load(&mesh).unwrap();
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, "[[meshes]]\npath = \"house.PLY\"\ntranslate = [0, 0, 0]\n").unwrap();
    assert!(seen(&load(&scene).unwrap()) == seen(&alone));
    fs::write(&mesh, "ply\n").unwrap();
    let message = load(&scene).unwrap_err().to_string();
    assert!(message.contains("house.PLY:2:1: the header does not end"), "{message}");
    fs::remove_file(&mesh).unwrap();
    let message = load(&scene).unwrap_err().to_string();
    assert!(message.contains("scene.toml:2:8: mesh `house.PLY`"), "{message}");
}
