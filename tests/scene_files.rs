//! Scene files and OBJ files from outside: what is right loads as it stands, and what is wrong is
//! one message with its place and its mend.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};
use octray::bvh::PrimKind;
use octray::scene::{LightShape, Shading, load_obj, load_toml};
use octray::{Hit, Loaded, Ray, load};
use proptest::prelude::*;

/// A scene that loads. Tests break one line of it.
const GOOD: &str = r#"[camera]
eye = [0, 1, 5]
target = [0, 0, 0]
[render]
width = 64
[materials.red]
color = [0.8, 0.1, 0.1]
[materials.white]
[[lights]]
type = "point"
position = [0, 5, 5]
[[spheres]]
center = [0, 0, 0]
radius = 1
material = "red"
"#;

fn parse(text: &str) -> Result<Loaded, String> {
    load_toml(text.as_bytes(), Path::new("a.toml")).map_err(|error| error.to_string())
}

fn parse_obj(text: &str) -> Result<Loaded, String> {
    load_obj(text.as_bytes(), Path::new("a.obj")).map_err(|error| error.to_string())
}

fn hit(loaded: &Loaded, origin: Vec3, dir: Vec3) -> Option<Hit> {
    loaded.scene.intersect(&Ray { origin, dir, t_min: 0.0, t_max: f32::INFINITY })
}

/// The message for `GOOD` with `from` replaced by `to`.
fn broken(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    parse(&GOOD.replacen(from, to, 1)).expect_err(to)
}

/// The message for `GOOD` with lines appended; their first one is line 16.
fn appended(text: &str) -> String {
    parse(&format!("{GOOD}{text}")).expect_err(text)
}

#[test]
fn the_good_scene_loads() {
    let loaded = parse(GOOD).unwrap();
    assert_eq!((loaded.settings.width, loaded.settings.height), (64, 600));
    assert_eq!(loaded.camera.vertical_fov, 40.0);
    assert_eq!(loaded.scene.material(0).diffuse, Vec3::new(0.8, 0.1, 0.1));
    assert_eq!(loaded.scene.lights()[0].shape, LightShape::Point(Vec3::new(0.0, 5.0, 5.0)));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    // Other line ends and a byte order mark change nothing, also not the places of errors.
    let windows = format!("\u{feff}{}", GOOD.replace('\n', "\r\n"));
    assert_eq!(parse(&windows).unwrap().scene.lights(), loaded.scene.lights());
    let error = parse(&windows.replace("radius = 1", "radius = -1")).unwrap_err();
    assert!(error.starts_with("a.toml:14:10: "), "{error}");
}

#[test]
fn what_is_wrong_in_a_scene_has_a_place_and_a_mend() {
    for (from, to, message) in [
        (
            "radius = 1",
            "raduis = 1",
            "14:1: unknown key `raduis`, expected one of `center`, `radius`, `material`; did you mean `radius`?",
        ),
        ("radius = 1", "", "12:1: missing key `radius`"),
        ("radius = 1", "radius = \"1\"", "14:10: invalid type: string \"1\", expected a number"),
        ("radius = 1", "radius = -1", "14:10: `radius` is -1: it must be finite and above 0"),
        (
            "radius = 1",
            "radius = 1e-60",
            "14:10: `radius` is 0.000000000000000000000000000000000000000000000000000000000001: it must be finite and above 0",
        ),
        ("radius = 1", "radius = nan", "14:10: `radius` is NaN: it must be finite and above 0"),
        (
            "radius = 1",
            "radius = 1\nradius = 2",
            "15:1: duplicate key: a key or [table] may be there once; remove one",
        ),
        (
            "radius = 1",
            "radius =",
            "14:9: there is no value, or a text without quotes: write one, such as 1 or \"name\"",
        ),
        (
            "[0, 0, 0]\nradius",
            "[0, inf, 0]\nradius",
            "13:10: `center` is [0, inf, 0]: its parts must be finite 32-bit floats",
        ),
        (
            "[0, 0, 0]\nradius",
            "[0, 1e39, 0]\nradius",
            "13:10: `center` is [0, 1000000000000000000000000000000000000000, 0]: its parts must be finite 32-bit floats",
        ),
        (
            "[0, 0, 0]\nradius",
            "[0, 0]\nradius",
            "13:10: invalid length 2, expected three numbers such as [0, 1.5, 0]",
        ),
        (
            "[0, 0, 0]\nradius",
            "[0, 0, 0, 0]\nradius",
            "13:10: invalid length 4, expected three numbers such as [0, 1.5, 0]",
        ),
        (
            "material = \"red\"",
            "material = \"whit\"",
            "15:12: there is no material `whit`: did you mean `white`?",
        ),
        (
            "material = \"red\"",
            "material = \"copper\"",
            "15:12: there is no material `copper`: there are `red`, `white`",
        ),
        (
            "[0, 1, 5]",
            "[0, 0, 0]",
            "3:10: camera `eye` and `target` are one point: move them apart",
        ),
        (
            "[0, 1, 5]",
            "[0, nan, 5]",
            "2:7: `eye` is [0, NaN, 5]: its parts must be finite 32-bit floats",
        ),
        (
            "[0, 1, 5]",
            "[0, 1, 0]",
            "1:1: camera `up` is zero or along the view: choose one across it, such as [0, 1, 0]",
        ),
        (
            "[render]",
            "up = [0, 2, 10]\n[render]",
            "4:6: camera `up` is zero or along the view: choose one across it, such as [0, 1, 0]",
        ),
        (
            "[render]",
            "vertical_fov = 180\n[render]",
            "4:16: camera `vertical_fov` is 180: it must be above 0 and below 180 degrees",
        ),
        ("width = 64", "width = 0", "5:9: `width` is 0: it must be from 1 to 65536"),
        ("width = 64", "height = 65537", "5:10: `height` is 65537: it must be from 1 to 65536"),
        (
            "width = 64",
            "width = 65536\nheight = 4097",
            "6:10: a picture of 65536 x 4097 has 268500992 pixels: it must have at most 268435456",
        ),
        (
            "width = 64",
            "width = 64.5",
            "5:9: invalid type: floating point `64.5`, expected a whole number",
        ),
        ("width = 64", "spp = 0", "5:7: `spp` is 0: it must be from 1 to 65536"),
        (
            "width = 64",
            "shadow_samples = -1",
            "5:18: `shadow_samples` is -1: it must be from 1 to 65536",
        ),
        (
            "width = 64",
            "max_bounces = 5000",
            "5:15: `max_bounces` is 5000: it must be from 0 to 1024",
        ),
        ("width = 64", "seed = -1", "5:8: `seed` is -1: it must be 0 or above"),
        (
            "width = 64",
            "background = [0, -1, 0]",
            "5:14: `background` is [0, -1, 0]: its parts must be finite and at least 0",
        ),
        (
            "width = 64",
            "build = \"slow\"",
            "5:9: unknown value `slow`, expected one of `fast`, `balanced`, `high`",
        ),
        (
            "width = 64",
            "shading = \"flat2\"",
            "5:11: unknown value `flat2`, expected `phong` or `flat`; did you mean `flat`?",
        ),
        (
            "color = [0.8, 0.1, 0.1]",
            "color = -0.5",
            "7:9: `color` is [-0.5, -0.5, -0.5]: its parts must be finite and at least 0",
        ),
        (
            "color = [0.8, 0.1, 0.1]",
            "mirror = 1.5",
            "7:10: `mirror` is 1.5: it must be from 0 to 1",
        ),
        (
            "color = [0.8, 0.1, 0.1]",
            "shininess = 0",
            "7:13: `shininess` is 0: it must be finite and above 0",
        ),
        (
            "[materials.white]",
            "[materials]\nwhite = 1",
            "9:9: invalid type: integer `1`, expected a table [materials.NAME]",
        ),
        ("\"point\"", "\"spot\"", "10:8: unknown value `spot`, expected `point` or `area`"),
        (
            "\"point\"",
            "\"area\"",
            "11:12: `position` belongs to type = \"point\", and this light is \"area\"",
        ),
        (
            "position = [0, 5, 5]",
            "",
            "9:1: a light of type \"point\" needs `position`, three numbers",
        ),
        (
            "position = [0, 5, 5]",
            "position = [0, 5, 5]\nambient = [nan, 0, 0]",
            "12:11: `ambient` is [NaN, 0, 0]: its parts must be finite and at least 0",
        ),
        (
            "type = \"point\"\nposition = [0, 5, 5]",
            "type = \"area\"\ncorner = [0, 0, 0]\nedge_u = [1, 0, 0]\nedge_v = [2, 0, 0]",
            "12:10: light: its edges are parallel: an area light needs an area",
        ),
    ] {
        assert_eq!(broken(from, to), format!("a.toml:{message}"), "{to}");
    }
}

#[test]
fn what_is_wrong_in_quads_and_meshes_has_a_place_and_a_mend() {
    for (text, message) in [
        (
            "[sky]",
            "16:2: unknown key `sky`, expected one of `camera`, `render`, `materials`, `lights`, `spheres`, `quads`, `meshes`",
        ),
        (
            "[[sphere]]",
            "16:3: unknown key `sphere`, expected one of `camera`, `render`, `materials`, `lights`, `spheres`, `quads`, `meshes`; did you mean `spheres`?",
        ),
        (
            "[[quads]]\ncorner = [0, 0, 0]\nedge_u = [1, 1, 1]\nedge_v = [2, 2, 2]",
            "18:10: the quad has no area, or reaches beyond the largest float: give edges that are not parallel",
        ),
        (
            "[[meshes]]\npath = \"none.obj\"",
            "17:8: mesh `none.obj` (looked for at none.obj): there is no such file: check the path",
        ),
        (
            "[[meshes]]\npath = \"none.stl\"",
            "17:8: mesh `none.stl` is neither an .obj nor a .ply file: convert it",
        ),
        (
            "[[meshes]]\nscale = 2",
            "16:1: a mesh needs `path`, an OBJ or PLY file relative to this one, or `generate`, one of \"knot\", \"icosphere\" and \"cuboid\"",
        ),
        (
            "[[meshes]]\npath = \"a.obj\"\ngenerate = \"cuboid\"",
            "18:12: a mesh has either `path` or `generate`: remove one",
        ),
        (
            "[[meshes]]\ngenerate = \"teapot\"",
            "17:12: unknown value `teapot`, expected one of `knot`, `icosphere`, `cuboid`",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nsides = 4",
            "18:9: `sides` belongs to generate = \"knot\": remove it",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nsize = 0",
            "18:8: `size` must be above 0 in all directions",
        ),
        (
            "[[meshes]]\ngenerate = \"icosphere\"\nsubdivisions = 10",
            "18:16: `subdivisions` is 10: it must be from 0 to 9",
        ),
        (
            "[[meshes]]\ngenerate = \"knot\"\nsegments = 2",
            "18:12: `segments` is 2: it must be from 3 to 32768",
        ),
        (
            "[[meshes]]\ngenerate = \"knot\"\nq = 4",
            "18:5: a knot with p = 2 and q = 4 runs over itself: they must have no common divisor",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nscale = [1, 0, 1]",
            "18:9: `scale` is [1, 0, 1]: its parts must be finite and not 0",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nrotate = [0, nan, 0]",
            "18:10: `rotate` is not finite: give angles in degrees",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nrotate = { axis = [0, 0, 0], degrees = 1 }",
            "18:10: the axis of `rotate` has no length: try [0, 1, 0]",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nrotate = { axis = [0, 0, 1] }",
            "18:10: missing key `degrees`",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nmatrix = [[1, 0, 0, 0], [2, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
            "18:10: `matrix` is singular or not finite: a transform must be finite and keep a volume a volume",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nmatrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]",
            "18:10: the last row of `matrix` is [0.0, 0.0, 1.0, 1.0]: it must be [0, 0, 0, 1]",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nmatrix = [[1, 0, 0, 0]]\nscale = 1",
            "18:10: invalid length 1, expected four rows of four numbers",
        ),
        (
            "[[meshes]]\ngenerate = \"cuboid\"\nscale = 2\nmatrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
            "18:9: a mesh has either `matrix` or `scale`, `rotate` and `translate`",
        ),
    ] {
        assert_eq!(appended(text), format!("a.toml:{message}"), "{text}");
    }
}

#[test]
fn a_scene_with_nothing_in_it_is_an_error_and_one_without_light_a_warning() {
    let nothing = &GOOD[..GOOD.find("[[spheres]]").unwrap()];
    let message = "a.toml: there is nothing to see: add [[spheres]], [[quads]] or [[meshes]]";
    assert_eq!(parse(nothing).unwrap_err(), message);
    let dark = GOOD.replace("[[lights]]\ntype = \"point\"\nposition = [0, 5, 5]\n", "");
    assert!(parse(&dark).unwrap().warnings[0].starts_with("a.toml: there is no light"));
}

#[test]
fn geometries_are_numbered_by_kind_and_material() {
    let loaded = parse(
        r#"
        [[meshes]]
        generate = "cuboid"
        translate = [0, 9, 0]
        [[quads]]
        corner = [9, -1, 1]
        edge_u = [0, 0, -2]
        edge_v = [0, 2, 0]
        [[spheres]]
        center = [0, 0, 9]
        radius = 1
        material = "b"
        [[spheres]]
        center = [0, 0, -9]
        radius = 1
        material = "a"
        [[spheres]]
        center = [-9, 0, 0]
        radius = 1
        material = "b"
        [materials.b]
        [materials.a]
        "#,
    )
    .unwrap();
    let ids = |dir| hit(&loaded, Vec3::ZERO, dir).map(|hit| (hit.geom_id, hit.prim_id));
    assert_eq!(ids(Vec3::Z), Some((0, 0)));
    assert_eq!(ids(Vec3::NEG_X), Some((0, 1)));
    assert_eq!(ids(Vec3::NEG_Z), Some((1, 0)));
    assert_eq!(ids(Vec3::X), Some((2, 0)));
    assert_eq!(ids(Vec3::Y).map(|(geom_id, _)| geom_id), Some(3));
    assert_eq!((0..4).map(|id| loaded.scene.material_id(id)).collect::<Vec<_>>(), [1, 0, 2, 2]);
}

#[test]
fn transforms_scale_then_rotate_then_translate() {
    let cuboid = |transform: &str| {
        let loaded = parse(&format!("[[meshes]]\ngenerate = \"cuboid\"\n{transform}"));
        loaded.unwrap().scene.bounds()
    };
    // Long in x, then along y, then moved up.
    let steps = cuboid("translate = [0, 10, 0]\nrotate = [0, 0, 90]\nscale = [4, 1, 2]");
    let matrix = cuboid("matrix = [[0, -1, 0, 0], [4, 0, 0, 10], [0, 0, 2, 0], [0, 0, 0, 1]]");
    let axis = cuboid(
        "translate = [0, 10, 0]\nrotate = { axis = [0, 0, 7], degrees = 90 }\nscale = [4, 1, 2]",
    );
    for bounds in [steps, matrix, axis] {
        assert!(bounds.min.distance(Vec3::new(-0.5, 8.0, -1.0)) < 1e-6, "{bounds:?}");
        assert!(bounds.max.distance(Vec3::new(0.5, 12.0, 1.0)) < 1e-6, "{bounds:?}");
    }
}

/// A folder that is removed at the end.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// The message for a file, with the path of its folder cut off.
fn refused(folder: &Path, name: &str) -> String {
    let message = load(&folder.join(name)).expect_err(name).to_string();
    message.replace(&format!("{}/", folder.display()), "")
}

#[test]
fn files_that_are_no_scene_are_refused() {
    let mesh = "[[meshes]]\npath = \"bad.obj\"\n";
    let folder = folder(&[
        ("empty.toml", ""),
        ("text.txt", "x"),
        ("bare", "x"),
        ("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
        ("bad.toml", mesh),
        ("dir.toml", &mesh.replace("bad.obj", "folder.obj")),
    ]);
    let at = folder.path();
    fs::create_dir(at.join("folder.obj")).unwrap();
    fs::write(at.join("wide.toml"), b"\xff\xfe[\0a\0]\0").unwrap();
    fs::write(at.join("binary.toml"), b"\x89PNG\0\0").unwrap();
    fs::write(at.join("latin.toml"), b"[camera]\n# caf\xe9\n").unwrap();
    for (name, message) in [
        ("none.toml", "none.toml: there is no such file: check the path"),
        ("none.txt", "none.txt: there is no such file: check the path"),
        ("folder.obj", "folder.obj: is a folder: name a file in it"),
        (
            "text.txt",
            "text.txt: is neither a scene nor a mesh: name a .toml, an .obj or a .ply file",
        ),
        ("bare", "bare: is neither a scene nor a mesh: name a .toml, an .obj or a .ply file"),
        ("wide.toml", "wide.toml: is UTF-16 text: save it as UTF-8"),
        (
            "binary.toml",
            "binary.toml: is a binary file: a scene is a TOML text and a mesh an OBJ text",
        ),
        ("latin.toml", "latin.toml:2:6: byte 0xe9 is not UTF-8: save the file as UTF-8"),
        ("bad.toml", "bad.obj:4:7: vertex 4 is not there: the file has 3"),
        (
            "dir.toml",
            "dir.toml:2:8: mesh `folder.obj` (looked for at folder.obj): is a folder: name a file \
             in it",
        ),
    ] {
        assert_eq!(refused(at, name), message);
    }
    assert!(refused(at, "empty.toml").starts_with("empty.toml: is empty: "));
}

#[cfg(unix)]
#[test]
fn pipes_and_unreadable_files_are_refused_at_once() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder(&[("secret.toml", GOOD)]);
    let at = folder.path();
    let made = std::process::Command::new("mkfifo").arg(at.join("pipe.toml")).status();
    if made.is_ok_and(|status| status.success()) {
        let message =
            "pipe.toml: is a pipe or a device: write its contents to a file and name that";
        assert_eq!(refused(at, "pipe.toml"), message);
    }
    fs::set_permissions(at.join("secret.toml"), fs::Permissions::from_mode(0o000)).unwrap();
    // The superuser reads it all the same.
    if fs::read(at.join("secret.toml")).is_err() {
        let message = "secret.toml: no permission to read it: change its mode";
        assert_eq!(refused(at, "secret.toml"), message);
    }
}

#[test]
fn what_is_wrong_in_an_obj_has_a_place_and_a_mend() {
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, message) in [
        ("v 0 x 0\n", "1:5: `x` is not a number"),
        ("v 0 0 0\n  v 1 2\n", "2:3: `v` has 2 numbers and needs 3"),
        ("v 0 0 0 0\n", "1:1: a vertex with weight 0 is nowhere: give 1"),
        ("vn 1 0\n", "1:1: `vn` has 2 numbers and needs 3"),
        ("TRI f 1 2 0", "4:7: vertex 0: indices count from 1"),
        ("TRI f 1 2 4", "4:7: vertex 4 is not there: the file has 3"),
        ("TRI f -1 -2 -4", "4:9: vertex -4 is not there: before this line there are 3"),
        ("TRI f 1 2 \\\n  4", "5:3: vertex 4 is not there: the file has 3"),
        ("TRI f 1//1 2 3", "4:3: normal 1 is not there: the file has 0"),
        ("TRI f 1 2 3.5", "4:7: `3.5` is not an index: write a whole number from 1"),
        (
            "TRI f 1 2 99999999999999999999",
            "4:7: `99999999999999999999` is not an index: write a whole number from 1",
        ),
        ("TRI f 1/// 2 3", "4:3: `1///` has too many parts: write v, v/vt, v//vn or v/vt/vn"),
    ] {
        let text = text.replace("TRI ", three);
        assert_eq!(parse_obj(&text).unwrap_err(), format!("a.obj:{message}"), "{text}");
    }
    let empty = parse_obj(three).unwrap_err();
    assert_eq!(empty, "a.obj: has no faces: a mesh needs at least one `f` line");
    let flat = parse_obj("v 0 0 0\nv 1 1 1\nv nan 0 0\nf 1 2 2\nf 1 2 3\n").unwrap_err();
    assert!(flat.contains("all triangles are without area or not finite"), "{flat}");
}

#[test]
fn objs_have_parts_by_object_and_material() {
    let folder = folder(&[
        (
            "two.obj",
            "# two squares and a triangle\r\nmtllib colours.mtl\r\n\
             o square\r\nusemtl red\r\nf 1 2 3 4\r\nusemtl blue\r\nf 5 6 7 8\r\n\
             g lonely\r\nusemtl gone\r\nf -8/1 -7/1 -6/1\r\n\
             v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\n\
             v 0 0 1 1 0 0\r\nv 2 0 2 2\r\nv 1 1 1\r\nv 0 1 1\r\nvt 0 0\r\nf 1 1 1\r\n",
        ),
        ("colours.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nNs 5\n"),
        ("scene.toml", "[[meshes]]\npath = \"two.obj\"\nmaterial = \"m\"\n[materials.m]\n"),
    ]);
    // The relative face stands before all vertices.
    let message = refused(folder.path(), "two.obj");
    assert!(message.starts_with("two.obj:10:3: vertex -8 is not there"), "{message}");
    let text = fs::read_to_string(folder.path().join("two.obj")).unwrap();
    let text = text.replace("f -8/1 -7/1 -6/1", "f 1/1 2/1 3/1");
    fs::write(folder.path().join("two.obj"), text).unwrap();

    let loaded = load(&folder.path().join("two.obj")).unwrap();
    let scene = &loaded.scene;
    assert_eq!(scene.primitive_count(PrimKind::Triangle), 6);
    assert_eq!(scene.geometry_count(), 3);
    assert_eq!(scene.material(0).diffuse, Vec3::X);
    assert_eq!((scene.material(1).diffuse, scene.material(1).shininess), (Vec3::Z, 5.0));
    assert_eq!(scene.dropped().degenerate, 1);
    let warnings = loaded.warnings.join("\n");
    assert!(warnings.contains("no material `gone`"), "{warnings}");
    assert!(warnings.contains("triangles left out because they have no area: 1"), "{warnings}");
    assert_eq!(scene.bounds().max, Vec3::ONE);

    let scene = load(&folder.path().join("scene.toml")).unwrap().scene;
    assert_eq!(scene.geometry_count(), 2, "by objects alone");

    fs::remove_file(folder.path().join("colours.mtl")).unwrap();
    let loaded = load(&folder.path().join("two.obj")).unwrap();
    let warnings = loaded.warnings.join("\n");
    assert!(warnings.contains("colours.mtl: there is no such file"), "{warnings}");
}

#[test]
fn obj_normals_are_kept_and_missing_ones_are_flat() {
    let loaded = parse_obj(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nvn 1 0 1\nf 1//1 2//1 3//1 4//1\n\
         f 2 5 6 3\n",
    )
    .unwrap();
    let normal = |x| {
        let ray = Ray {
            origin: Vec3::new(x, 0.4, 2.0),
            dir: Vec3::NEG_Z,
            t_min: 0.0,
            t_max: f32::INFINITY,
        };
        let hit = loaded.scene.intersect(&ray).unwrap();
        loaded.scene.surface(&ray, &hit).shading_normal
    };
    assert!(normal(0.5).distance(Vec3::new(1.0, 0.0, 1.0).normalize()) < 1e-6);
    assert_eq!(normal(1.5), Vec3::Z);
}

#[test]
fn a_mesh_alone_is_framed_and_lit() {
    let loaded = parse_obj("v -9 5 0\nv 9 5 0\nv 0 45 0\nf 1 2 3\n").unwrap();
    let camera = loaded.camera;
    let view = camera.view(1.0).unwrap();
    let middle = hit(&loaded, view.eye, view.dir(Vec2::splat(0.5))).unwrap();
    assert_eq!(middle.geom_id, 0);
    // Nothing sticks out: no ray along the edge of a square picture hits.
    for i in 0..=100 {
        let s = i as f32 / 100.0;
        for at in [(s, 0.0), (s, 1.0), (0.0, s), (1.0, s)] {
            assert_eq!(hit(&loaded, view.eye, view.dir(Vec2::from(at))), None);
        }
    }
    assert_eq!(camera.up, Vec3::Y);
    let light = loaded.scene.lights()[0];
    let at = light.shape.at(0.5, 0.5);
    assert!(at.y > 45.0 && at.z > 0.0 && light.ambient.min_element() > 0.0);
    let LightShape::Quad { edge_u, edge_v, .. } = light.shape else { panic!("a point light") };
    assert!(edge_u.dot(edge_v).abs() < 1e-3);
    assert!((edge_u.length() - loaded.scene.bounds().diagonal() * 0.25).abs() < 1e-3);
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn all_scenes_load_and_show_something() {
    let mut names = Vec::new();
    for entry in fs::read_dir(root().join("scenes")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let loaded = load(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let settings = loaded.settings;
        let view = loaded.camera.view(settings.width as f32 / settings.height as f32).unwrap();
        let seen = hit(&loaded, view.eye, view.dir(Vec2::splat(0.5)));
        assert!(seen.is_some(), "{} has nothing in its middle", path.display());
        assert!(settings.shading == Shading::Flat || !loaded.scene.lights().is_empty());
        names.push(path.file_stem().unwrap().to_str().unwrap().to_owned());
    }
    names.sort();
    assert_eq!(
        names,
        [
            "cornell-box",
            "cornell-flat",
            "cornell-hard-shadows",
            "cornell-phong",
            "cornell-soft-shadows",
            "mesh",
            "mirror-sphere",
            "penumbra",
            "quad",
            "sphere"
        ]
    );
    let mesh = load(&root().join("scenes/mesh.toml")).unwrap().scene;
    assert!(mesh.primitive_count(PrimKind::Triangle) >= 10_000);
}

/// The keys that a table knows: what it says when it is given one that it does not.
fn keys_of(table: &str) -> Vec<String> {
    let message = parse(&format!("{table}\n'?' = 1\n")).expect_err(table);
    let (_, known) = message.split_once(", expected one of ").expect("a list of keys");
    known.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn the_page_names_every_key_and_its_example_loads() {
    let page = fs::read_to_string(root().join("docs/scene-files.md")).unwrap();
    let example = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let loaded = parse(example).unwrap();
    assert!(loaded.warnings.is_empty());
    let sections: Vec<&str> = page.split("\n## ").collect();
    for (table, title) in [
        ("[camera]", "`[camera]`"),
        ("[render]", "`[render]`"),
        ("[materials.a]", "`[materials.NAME]`"),
        ("[[lights]]", "`[[lights]]`"),
        ("[[spheres]]", "`[[spheres]]`"),
        ("[[quads]]", "`[[quads]]`"),
        ("[[meshes]]", "`[[meshes]]`"),
    ] {
        let section = sections.iter().find(|section| section.starts_with(title)).expect(title);
        let keys = keys_of(table);
        assert!(keys.len() >= 3, "{keys:?}");
        for key in keys {
            let rows = section.lines().filter_map(|line| line.split('|').nth(1));
            let named = rows.flat_map(|row| row.split('`')).any(|name| name == key);
            assert!(named, "`{key}` of {table} is not documented");
        }
    }
    for table in keys_of("") {
        assert!(page.contains(&format!("[{table}")), "[{table}] is not documented");
    }
}

/// A few of these words and line ends make nearly a file.
fn soup(words: &'static [&'static str]) -> impl Strategy<Value = String> {
    proptest::collection::vec(proptest::sample::select(words), 0..60)
        .prop_map(|words| words.join(" "))
}

const OBJ_WORDS: &[&str] = &[
    "\nv",
    "\nv 0 0 0",
    "\nv 1 0 0",
    "\nv 0 1 0",
    "\nvn",
    "\nvt",
    "\nf",
    "\nf 1 2 3",
    "\no",
    "\ng",
    "\nusemtl",
    "\nmtllib",
    "\nl",
    "\np",
    "\n#",
    "\\\n",
    "\n",
    "1",
    "-1",
    "2//1",
    "3/1/1",
    "0",
    "1e39",
    "nan",
    "-inf",
    "/",
    "1/",
    "4294967297",
    "9223372036854775807",
    "-9223372036854775808",
    "x",
    "\u{e4}",
    "\r",
];

const TOML_WORDS: &[&str] = &[
    "\n[camera]\n",
    "\n[render]\n",
    "\n[[spheres]]\n",
    "\n[[meshes]]\n",
    "\n[materials.a]\n",
    "\n[[lights]]\n",
    "eye =",
    "target =",
    "center =",
    "radius =",
    "width =",
    "material =",
    "\"a\"",
    "[0, 0, 0]",
    "[0, 0, 1]",
    "1",
    "-1",
    "nan",
    "inf",
    "1e308",
    "{",
    "}",
    "[",
    "]",
    ",",
    "\n",
    "'",
    "\"\"\"",
    "=",
    ".",
    "1979-05-27",
    "generate = \"cuboid\"\n",
    "scale =",
    "rotate =",
    "matrix =",
    "\u{e4}",
    "#",
];

proptest! {
    #[test]
    fn no_obj_panics(text in soup(OBJ_WORDS)) {
        let _ = parse_obj(&text);
    }

    #[test]
    fn no_scene_panics(text in soup(TOML_WORDS)) {
        if let Err(message) = parse(&text) {
            prop_assert!(!message.contains('\n'), "{}", message);
        }
    }

    #[test]
    fn no_damage_to_a_scene_panics(at in 0..GOOD.len(), byte: u8, cut: bool) {
        let mut bytes = GOOD.as_bytes().to_vec();
        if cut { bytes.truncate(at) } else { bytes[at] = byte }
        if let Err(error) = load_toml(&bytes, Path::new("a.toml")) {
            prop_assert!(!error.to_string().contains('\n'), "{}", error);
        }
    }
}
