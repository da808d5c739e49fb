//! `[[meshes]]`: a file or a generated shape, and where it stands.

use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};
use toml::Spanned;

use super::check::Source;
use super::error::{LoadError, Problem};
use super::keys::{Key, MeshKeys, MeshName};
use super::transform::{Transform, rotation_by_angles, rotation_by_axis};
use super::values::{OneOrThree, Rotation, Triple};
use crate::geometry::Mesh;
use crate::geometry::shapes::{self, TorusKnot};
use crate::scene::mesh_file::{self, MeshFile};

/// The most rings along a generated tube.
const MAX_SEGMENTS: u32 = 32_768;

/// The most vertices a ring.
const MAX_SIDES: u32 = 1_024;

/// The parts of one `[[meshes]]` table, in place: one for a generated shape, else as the file has
/// them.
pub(super) fn read(source: Source<'_>, at: &Spanned<MeshKeys>) -> Result<MeshFile, LoadError> {
    let keys = at.get_ref();
    let transform = transform(source, keys)?;
    let mut parts = match (&keys.path, &keys.generate) {
        (Some(path), None) => {
            refuse_parameters(source, keys, None)?;
            from_file(source, path, keys.material.is_some())?
        }
        (None, Some(name)) => {
            refuse_parameters(source, keys, Some(*name.get_ref()))?;
            MeshFile::of_mesh(generated(source, keys, *name.get_ref())?)
        }
        (Some(_), Some(name)) => {
            let message = "a mesh has either `path` or `generate`: remove one".into();
            return Err(source.fail(name.span(), Problem::Format(message)));
        }
        (None, None) => {
            let message = "a mesh needs `path`, an OBJ or PLY file relative to this one, or \
                           `generate`, one of \"knot\", \"icosphere\" and \"cuboid\"";
            return Err(source.fail(at.span(), Problem::Format(message.into())));
        }
    };
    if let Some(transform) = transform {
        for part in &mut parts.parts {
            transform.apply(&mut part.mesh);
        }
    }
    Ok(parts)
}

/// A mesh file. That it can't be read is the scene's error; what is in it is its own.
fn from_file(
    source: Source<'_>,
    path: &Spanned<String>,
    overridden: bool,
) -> Result<MeshFile, LoadError> {
    let name = path.get_ref();
    let file = source.file.parent().map_or_else(|| name.into(), |folder| folder.join(name));
    let Some(mesh) = mesh_file::read(&file, !overridden) else {
        let message = format!("mesh `{name}` is neither an .obj nor a .ply file: convert it");
        return Err(source.wrong(path, message));
    };
    mesh.map_err(|error| match error.problem {
        Problem::Unreadable(_) | Problem::Kind(_) if error.place.is_none() => {
            let problem = error.problem;
            let shown = file.display();
            let message = format!("mesh `{name}` (looked for at {shown}): {problem}");
            source.wrong(path, message)
        }
        _ => error,
    })
}

/// An error for a parameter that another generator, or none, has.
fn refuse_parameters(
    source: Source<'_>,
    keys: &MeshKeys,
    name: Option<MeshName>,
) -> Result<(), LoadError> {
    fn span<T>(at: &Key<T>) -> Option<Range<usize>> {
        at.as_ref().map(Spanned::span)
    }
    let (knot, icosphere, cuboid) = (MeshName::Knot, MeshName::Icosphere, MeshName::Cuboid);
    for (key, span, owner, owner_name) in [
        ("p", span(&keys.p), knot, "knot"),
        ("q", span(&keys.q), knot, "knot"),
        ("radius", span(&keys.radius), knot, "knot"),
        ("spread", span(&keys.spread), knot, "knot"),
        ("tube", span(&keys.tube), knot, "knot"),
        ("segments", span(&keys.segments), knot, "knot"),
        ("sides", span(&keys.sides), knot, "knot"),
        ("subdivisions", span(&keys.subdivisions), icosphere, "icosphere"),
        ("size", span(&keys.size), cuboid, "cuboid"),
    ] {
        if let (Some(span), true) = (span, name != Some(owner)) {
            let message = format!("`{key}` belongs to generate = \"{owner_name}\": remove it");
            return Err(source.fail(span, Problem::Format(message)));
        }
    }
    Ok(())
}

fn generated(source: Source<'_>, keys: &MeshKeys, name: MeshName) -> Result<Mesh, LoadError> {
    match name {
        MeshName::Knot => knot(source, keys),
        MeshName::Icosphere => {
            let subdivisions = keys.subdivisions.as_ref();
            let subdivisions =
                subdivisions.map_or(Ok(4), |at| source.whole("subdivisions", at, 0..=9))?;
            Ok(shapes::icosphere(subdivisions))
        }
        MeshName::Cuboid => {
            let Some(at) = &keys.size else { return Ok(shapes::cuboid(Vec3::ONE)) };
            let size = source.color("size", at)?;
            if size.min_element() <= 0.0 {
                return Err(source.wrong(at, "`size` must be above 0 in all directions".into()));
            }
            Ok(shapes::cuboid(size))
        }
    }
}

fn knot(source: Source<'_>, keys: &MeshKeys) -> Result<Mesh, LoadError> {
    let default = TorusKnot::default();
    let whole = |key, at: &Key<_>, range, default| {
        at.as_ref().map_or(Ok(default), |at| source.whole(key, at, range))
    };
    let length =
        |key, at: &Key<_>, default| at.as_ref().map_or(Ok(default), |at| source.positive(key, at));
    let knot = TorusKnot {
        p: whole("p", &keys.p, 1..=64, default.p)?,
        q: whole("q", &keys.q, 0..=64, default.q)?,
        radius: length("radius", &keys.radius, default.radius)?,
        spread: length("spread", &keys.spread, default.spread)?,
        tube: length("tube", &keys.tube, default.tube)?,
        segments: whole("segments", &keys.segments, 3..=MAX_SEGMENTS, default.segments)?,
        sides: whole("sides", &keys.sides, 3..=MAX_SIDES, default.sides)?,
    };
    if common_divisor(knot.p, knot.q) != 1 {
        let message = format!(
            "a knot with p = {} and q = {} runs over itself: they must have no common divisor",
            knot.p, knot.q
        );
        let at = keys.q.as_ref().or(keys.p.as_ref()).map_or(0..0, Spanned::span);
        return Err(source.fail(at, Problem::Value(message)));
    }
    Ok(shapes::torus_knot(&knot))
}

fn common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// The transform of a mesh: `matrix`, or scale, then rotation, then translation.
fn transform(source: Source<'_>, keys: &MeshKeys) -> Result<Option<Transform>, LoadError> {
    let translate = keys.translate.as_ref();
    let steps = [
        keys.scale.as_ref().map(Spanned::span),
        keys.rotate.as_ref().map(Spanned::span),
        translate.map(Spanned::span),
    ];
    let first_step = steps.into_iter().flatten().next();
    let singular = |span, what: &str| {
        let message = format!("{what}: a transform must be finite and keep a volume a volume");
        Err(source.fail(span, Problem::Value(message)))
    };
    if let Some(at) = &keys.matrix {
        if let Some(span) = first_step {
            let message = "a mesh has either `matrix` or `scale`, `rotate` and `translate`";
            return Err(source.fail(span, Problem::Format(message.into())));
        }
        let [x, y, z, last] = at.get_ref().0;
        if last != [0.0, 0.0, 0.0, 1.0] {
            let message = format!("the last row of `matrix` is {last:?}: it must be [0, 0, 0, 1]");
            return Err(source.wrong(at, message));
        }
        let linear = DMat3::from_cols_array_2d(&[x, y, z].map(|[a, b, c, _]| [a, b, c]));
        let shift = DVec3::new(x[3], y[3], z[3]);
        return match Transform::new(linear.transpose(), shift) {
            Some(transform) => Ok(Some(transform)),
            None => singular(at.span(), "`matrix` is singular or not finite"),
        };
    }
    let Some(first_step) = first_step else { return Ok(None) };
    let scale = scale(source, &keys.scale)?;
    let rotation = keys.rotate.as_ref().map_or(Ok(DMat3::IDENTITY), |at| rotate(source, at))?;
    let shift =
        translate.map_or(Ok(Vec3::ZERO), |at: &Spanned<Triple>| source.vector("translate", at))?;
    match Transform::new(rotation * DMat3::from_diagonal(scale), shift.as_dvec3()) {
        Some(transform) => Ok(Some(transform)),
        None => singular(first_step, "the transform is singular"),
    }
}

fn scale(source: Source<'_>, at: &Key<OneOrThree>) -> Result<DVec3, LoadError> {
    let Some(at) = at else { return Ok(DVec3::ONE) };
    let scale = at.get_ref().0;
    if !scale.is_finite() || scale.to_array().contains(&0.0) {
        let message = format!("`scale` is {scale}: its parts must be finite and not 0");
        return Err(source.wrong(at, message));
    }
    Ok(scale)
}

fn rotate(source: Source<'_>, at: &Spanned<Rotation>) -> Result<DMat3, LoadError> {
    let not_finite = || source.wrong(at, "`rotate` is not finite: give angles in degrees".into());
    match *at.get_ref() {
        Rotation::Angles(degrees) if degrees.is_finite() => Ok(rotation_by_angles(degrees)),
        Rotation::Axis { axis, degrees } if axis.is_finite() && degrees.is_finite() => {
            rotation_by_axis(axis, degrees).ok_or_else(|| {
                source.wrong(at, "the axis of `rotate` has no length: try [0, 1, 0]".into())
            })
        }
        _ => Err(not_finite()),
    }
}
