//! Sixteen hits become sixteen points to be lit, mirror rays, and the light that needs no shadow ray.

use glam::Vec3;

use crate::hit::NO_HIT;
use crate::render::arena::{ArenaHits, ArenaRays};
use crate::render::colors::Colors;
use crate::render::frame::Frame;
use crate::scene::{HitLanes, LANES, SharedPrimitive, SurfaceLanes, Vectors, dot};
use crate::shading::phong_lanes::{mirrored, of_materials, to_viewer};
use crate::simd::{F32x16, LaneMask, Lanes, each};

/// Sixteen places where light is looked up.
#[derive(Clone, Copy)]
pub(super) struct ShadingPoints {
    /// The lanes that are such places, one bit each.
    pub(super) mask: u32,
    /// The camera ray that each belongs to.
    pub(super) path: [u32; LANES],
    /// The number of its material.
    pub(super) material: [u32; LANES],
    /// What its own colour counts for in the path's.
    pub(super) weight: F32x16,
    pub(super) position: Vectors,
    /// Where its shadow rays start: off the surface, on the viewer's side.
    pub(super) origin: Vectors,
    /// The unit normals on the viewer's side.
    pub(super) normal: Vectors,
    pub(super) geometric_normal: Vectors,
    /// The direction of the ray that met it.
    pub(super) dir: Vectors,
}

impl ShadingPoints {
    /// No place at all.
    pub(super) fn none() -> Self {
        let zero = F32x16::splat(0.0);
        Self {
            mask: 0,
            path: [0; LANES],
            material: [0; LANES],
            weight: zero,
            position: [zero; 3],
            origin: [zero; 3],
            normal: [zero; 3],
            geometric_normal: [zero; 3],
            dir: [zero; 3],
        }
    }
}

/// Looks at the sixteen hits from `start`: adds ambient light and background to the paths' colours and
/// the rays of mirrors to `mirrors`, if there is one. True if `points` now holds points to be lit: they
/// take 1.2 KB, so they are written where they stay.
#[inline(always)]
pub(super) fn shade(
    frame: &Frame<'_>,
    (rays, hits, start): (&ArenaRays<'_>, &ArenaHits<'_>, usize),
    last: &mut SharedPrimitive,
    mirrors: Option<&mut ArenaRays<'_>>,
    (colors, points): (&mut Colors<'_>, &mut ShadingPoints),
) -> bool {
    let (asked, path, weight) = (rays.lanes(start), rays.paths(start), rays.weights(start));
    let geom_id = hits.geom_ids(start);
    let mut hit = 0;
    for (lane, &geom_id) in geom_id.iter().enumerate() {
        hit |= u32::from(geom_id != NO_HIT) << lane;
    }
    let mask = hit & asked;
    let background = splat(frame.settings.background);
    if mask == 0 {
        colors.add(path, asked, &each(|axis| background[axis] * weight));
        return false;
    }
    let [t, u, v] = hits.places(start);
    let dir = rays.dirs(start);
    let at = HitLanes {
        mask,
        origin: rays.origins(start),
        dir,
        t,
        u,
        v,
        prim_id: hits.prim_ids(start),
        geom_id,
    };
    let mut surface = frame.scene.surfaces(&at, last);
    turn_to_viewer(&mut surface, &dir);
    let materials = frame.scene.materials();
    let [r, g, b, mirror] = of_materials(materials, &surface.material, |material| {
        let ambient = material.ambient;
        [ambient.x, ambient.y, ambient.z, material.mirror]
    });
    let own = weight * (F32x16::splat(1.0) - mirror);
    let (ambient, light) = ([r, g, b], splat(frame.ambient));
    let is_hit = F32x16::mask(mask);
    let color = each(|axis| {
        let here = light[axis] * ambient[axis] * own;
        Lanes::select(is_hit, here, background[axis] * weight)
    });
    colors.add(path, asked, &color);

    let zero = F32x16::splat(0.0);
    let origin = surface.offset_origin();
    if let Some(mirrors) = mirrors {
        let reflects = Lanes::gt(mirror, zero).bits() & mask;
        if reflects != 0 {
            let dir = mirror_dirs(&surface, &to_viewer(&dir));
            mirrors.push((&origin, &dir), (path, weight * mirror), reflects);
        }
    }
    let mask = Lanes::gt(own, zero).bits() & mask;
    if mask == 0 {
        return false;
    }
    points.mask = mask;
    points.path = *path;
    points.material = surface.material;
    points.weight = own;
    // Register by register: arrays are copied by halves of them, and who loads a whole one then waits.
    for axis in 0..3 {
        points.position[axis] = surface.position[axis];
        points.origin[axis] = origin[axis];
        points.normal[axis] = surface.shading_normal[axis];
        points.geometric_normal[axis] = surface.geometric_normal[axis];
        points.dir[axis] = dir[axis];
    }
    true
}

#[inline(always)]
fn splat(vector: Vec3) -> Vectors {
    each(|axis| F32x16::splat(vector[axis]))
}

/// Puts both normals on the side that rays along `dir` come from: surfaces have two sides.
#[inline(always)]
fn turn_to_viewer(surface: &mut SurfaceLanes, dir: &Vectors) {
    let behind = Lanes::gt(dot(&surface.geometric_normal, dir), F32x16::splat(0.0));
    let turned = |normal: &Vectors| each(|axis| Lanes::select(behind, -normal[axis], normal[axis]));
    surface.geometric_normal = turned(&surface.geometric_normal);
    surface.shading_normal = turned(&surface.shading_normal);
}

/// Where mirrors send rays on to. An interpolated normal can point a ray through the surface; then the
/// surface's own normal mirrors it.
#[inline(always)]
fn mirror_dirs(surface: &SurfaceLanes, to_viewer: &Vectors) -> Vectors {
    let dir = mirrored(to_viewer, &surface.shading_normal);
    let through = Lanes::le(dot(&dir, &surface.geometric_normal), F32x16::splat(0.0));
    let other = mirrored(to_viewer, &surface.geometric_normal);
    each(|axis| Lanes::select(through, other[axis], dir[axis]))
}
