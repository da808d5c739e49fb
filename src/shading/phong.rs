//! The Phong reflection model (Phong 1975), with separate parts for each term:
//!
//! ```text
//! I = Ia Ka + sum over lights of visible [ Ild Kd (L.N) + Ils Ks (R.V)^n ],  R = 2 (N.L) N - L
//! ```
//!
//! `Ia` is the sum of the ambient parts of all lights, `visible` the fraction of the light that the
//! point sees, `L` the direction to the light (to its centre, if it has an area), `V` the direction
//! to the viewer. Dot products are clamped at zero, and a light behind the surface gives nothing.
//! Distance does not dim a light.
//!
//! All vectors are of unit length; colours are linear RGB.

use glam::Vec3;

use crate::scene::{Light, LightShape, Material};

/// `Ia`: the ambient light, which reaches every point.
pub fn ambient_light(lights: &[Light]) -> Vec3 {
    lights.iter().fold(Vec3::ZERO, |sum, light| sum + light.ambient)
}

/// The point that `L` aims at: the centre of an area light.
pub fn light_center(shape: &LightShape) -> Vec3 {
    shape.at(0.5, 0.5)
}

/// The bracket of the formula: what `light` gives, fully seen. Zero for a light behind the surface.
///
/// `normal` is on the viewer's side.
pub fn reflected(
    light: &Light,
    material: &Material,
    normal: Vec3,
    to_light: Vec3,
    to_viewer: Vec3,
) -> Vec3 {
    let cosine = to_light.dot(normal);
    if cosine.is_nan() || cosine <= 0.0 {
        return Vec3::ZERO;
    }
    let diffuse = light.diffuse * material.diffuse * cosine;
    if material.specular == Vec3::ZERO {
        return diffuse;
    }
    let highlight = mirrored(to_light, normal).dot(to_viewer).max(0.0).powf(material.shininess);
    diffuse + light.specular * material.specular * highlight
}

/// `R = 2 (N.L) N - L`: the direction `dir`, which points away from the surface, mirrored about
/// `normal`. It points away from the surface, too.
pub fn mirrored(dir: Vec3, normal: Vec3) -> Vec3 {
    normal * (2.0 * normal.dot(dir)) - dir
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(diffuse: f32, specular: f32) -> Light {
        Light {
            shape: LightShape::Point(Vec3::Y),
            ambient: Vec3::splat(0.25),
            diffuse: Vec3::splat(diffuse),
            specular: Vec3::splat(specular),
        }
    }

    #[test]
    fn the_terms_are_those_of_the_formula() {
        let material = Material {
            ambient: Vec3::ONE,
            diffuse: Vec3::new(0.5, 0.25, 1.0),
            specular: Vec3::splat(0.5),
            shininess: 4.0,
            mirror: 0.0,
        };
        let to_light = Vec3::new(0.6, 0.8, 0.0);
        let mirror = Vec3::new(-0.6, 0.8, 0.0);
        assert!((mirrored(to_light, Vec3::Y) - mirror).length() < 1e-6);
        let matt = reflected(&light(2.0, 0.0), &material, Vec3::Y, to_light, Vec3::Y);
        assert!((matt - Vec3::new(0.8, 0.4, 1.6)).length() < 1e-6);
        let at_peak = reflected(&light(0.0, 3.0), &material, Vec3::Y, to_light, mirror);
        assert!((at_peak - Vec3::splat(1.5)).length() < 1e-5);
        let beside = reflected(&light(0.0, 3.0), &material, Vec3::Y, to_light, Vec3::Y);
        assert!((beside - Vec3::splat(1.5 * 0.8_f32.powi(4))).length() < 1e-5);
    }

    #[test]
    fn light_from_behind_gives_nothing() {
        let material = Material { specular: Vec3::ONE, ..Material::default() };
        for to_light in [Vec3::NEG_Y, Vec3::X, Vec3::NAN] {
            let seen = reflected(&light(1.0, 1.0), &material, Vec3::Y, to_light, Vec3::NEG_Y);
            assert_eq!(seen, Vec3::ZERO);
        }
    }

    #[test]
    fn ambient_parts_add_up() {
        assert_eq!(ambient_light(&[light(1.0, 1.0); 3]), Vec3::splat(0.75));
        assert_eq!(ambient_light(&[]), Vec3::ZERO);
    }
}
