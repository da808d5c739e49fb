//! The scenes.

use std::path::Path;

use glam::Vec3;
use octray::Mesh;
use octray::workload::{Model, scenes};

use crate::options::Options;

/// A function that makes a scene of so many triangles, by its name.
type Make = fn(usize) -> Model;

/// The made scenes, by name.
const MADE: [(&str, Make); 6] = [
    ("terrain", |triangles| scenes::terrain(triangles)),
    ("dense", |triangles| scenes::dense_scan(triangles)),
    ("atrium", |_| scenes::atrium()),
    ("sphereflake", |triangles| scenes::sphereflake(triangles / 10)),
    ("mixed", |triangles| scenes::mixed(triangles / 100)),
    (BY_NAME_ALONE, |_| scenes::grating(400)),
];

/// The scene that is measured only if it is asked for.
const BY_NAME_ALONE: &str = "grating";

/// Makes the scenes that the options ask for, one at a time: they are large.
pub(crate) fn wanted(options: &Options) -> impl Iterator<Item = Result<Model, String>> {
    let given = std::env::var_os("OCTRAY_BENCH_MESH").filter(|path| !path.is_empty());
    let mesh = given.and_then(|path| {
        let path = Path::new(&path).to_owned();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        options.wants_scene(&name, true).then(|| {
            let mesh = load_obj(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            Ok(Model::on_ground(&name, mesh))
        })
    });
    let triangles = options.kilotriangles * 1000;
    let usual = |name: &str| !options.scene.is_empty() || name != BY_NAME_ALONE;
    let made = MADE.iter().filter(move |(name, _)| usual(name) && options.wants_scene(name, false));
    mesh.into_iter().chain(made.map(move |(_, make)| Ok(make(triangles))))
}

/// All triangles of an OBJ file as one mesh.
fn load_obj(path: &Path) -> Result<Mesh, tobj::LoadError> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options)?;
    let mut mesh = Mesh::default();
    for model in models {
        let first = mesh.positions.len() as u32;
        let positions = model.mesh.positions.chunks_exact(3);
        mesh.positions.extend(positions.map(Vec3::from_slice));
        let triangles = model.mesh.indices.chunks_exact(3);
        mesh.indices.extend(triangles.map(|at| [first + at[0], first + at[1], first + at[2]]));
    }
    Ok(mesh)
}
