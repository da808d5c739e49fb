//! The Phong formula of [`super::phong`] for sixteen points at once.
//!
//! Colours are those of the formula but for rounding: powers are computed by polynomials, whose
//! relative error is below 1e-5 wherever a highlight can be seen. All else has the same bits.

use glam::Vec3;

use crate::scene::{Light, Material, Vectors, dot, normalized_or};
use crate::simd::{F32x16, LaneMask, Lanes, each};

const LANES: usize = F32x16::LANES;

/// What `of` gives for the materials with these numbers.
#[inline(always)]
pub(crate) fn of_materials<const VALUES: usize>(
    materials: &[Material],
    numbers: &[u32; LANES],
    of: impl Fn(&Material) -> [f32; VALUES],
) -> [F32x16; VALUES] {
    let mut others = 0;
    for lane in 1..LANES {
        others |= numbers[lane] ^ numbers[0];
    }
    if others == 0 {
        let values = of(&materials[numbers[0] as usize]);
        return each(|place| F32x16::splat(values[place]));
    }
    let mut lanes = [[0.0; LANES]; VALUES];
    for (lane, &number) in numbers.iter().enumerate() {
        let values = of(&materials[number as usize]);
        for place in 0..VALUES {
            lanes[place][lane] = values[place];
        }
    }
    each(|place| F32x16::new(lanes[place]))
}

/// The unit directions back along rays; zero for those that have no length.
#[inline(always)]
pub(crate) fn to_viewer(dir: &Vectors) -> Vectors {
    let toward = normalized_or(dir, &[F32x16::splat(0.0); 3]);
    each(|axis| -toward[axis])
}

/// [`super::phong::reflected`] for points with these materials, which rays along `dir` met. How long
/// directions are is asked only where something shines.
#[inline(always)]
pub(crate) fn reflected(
    light: &Light,
    (materials, numbers): (&[Material], &[u32; LANES]),
    normal: &Vectors,
    to_light: &Vectors,
    dir: &Vectors,
) -> Vectors {
    let zero = F32x16::splat(0.0);
    let cosine = dot(to_light, normal);
    let lit = Lanes::gt(cosine, zero);
    if !lit.any() {
        return [zero; 3];
    }
    let [r, g, b, sr, sg, sb, shininess] = of_materials(materials, numbers, |material| {
        let (matt, shiny) = (material.diffuse, material.specular);
        [matt.x, matt.y, matt.z, shiny.x, shiny.y, shiny.z, material.shininess]
    });
    let part = |of: Vec3, axis: usize| F32x16::splat(of[axis]);
    let color = [r, g, b];
    let mut sum: Vectors = each(|axis| part(light.diffuse, axis) * color[axis] * cosine);
    let specular = [sr, sg, sb];
    let shines = Lanes::gt(sr, zero) | Lanes::gt(sg, zero) | Lanes::gt(sb, zero);
    if (shines & lit).any() {
        let toward = Lanes::max(dot(&mirrored(to_light, normal), &to_viewer(dir)), zero);
        let highlight = powers(toward, shininess);
        sum = each(|axis| sum[axis] + part(light.specular, axis) * specular[axis] * highlight);
    }
    each(|axis| Lanes::select(lit, sum[axis], zero))
}

/// [`super::phong::mirrored`], with the same bits.
#[inline(always)]
pub(crate) fn mirrored(dir: &Vectors, normal: &Vectors) -> Vectors {
    let twice = F32x16::splat(2.0) * dot(normal, dir);
    each(|axis| normal[axis] * twice - dir[axis])
}

#[inline(always)]
fn powers(base: F32x16, exponent: F32x16) -> F32x16 {
    let (base, exponent) = (base.to_array(), exponent.to_array());
    let mut powers = [0.0; LANES];
    for lane in 0..LANES {
        powers[lane] = power(base[lane], exponent[lane]);
    }
    F32x16::new(powers)
}

/// `base` to the power of `exponent`, both finite, neither negative. 0 for a base below the smallest
/// normal float. Without branches and calls, so that it runs in lanes.
#[inline(always)]
fn power(base: f32, exponent: f32) -> f32 {
    // base = 2^scale * near, with `near` from sqrt(1/2) to sqrt(2).
    const SQRT_HALF: u32 = 0x3f35_04f3;
    let above = base.to_bits().wrapping_sub(SQRT_HALF);
    let scale = (above as i32 >> 23) as f32;
    let near = f32::from_bits((above & 0x007f_ffff) + SQRT_HALF);
    // ln near = 2 artanh((near - 1) / (near + 1)), whose series loses nothing next to 1.
    let s = (near - 1.0) / (near + 1.0);
    let s2 = s * s;
    let series = 1.0 + s2 * (1.0 / 3.0 + s2 * (1.0 / 5.0 + s2 * (1.0 / 7.0 + s2 * (1.0 / 9.0))));
    let log = scale + s * series * (2.0 * std::f32::consts::LOG2_E);
    let log = (exponent * log).clamp(-126.0, 127.0);
    // Adding 1.5 * 2^23 rounds to a whole number, which the last bits then hold.
    const ROUND: f32 = 12_582_912.0;
    let rounded = log + ROUND;
    let whole = rounded.to_bits().wrapping_sub(ROUND.to_bits());
    let f = (log - (rounded - ROUND)) * std::f32::consts::LN_2;
    let exp = 1.0
        + f * (1.0
            + f * (1.0 / 2.0
                + f * (1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f * (1.0 / 720.0))))));
    let value = exp * f32::from_bits(whole.wrapping_add(127) << 23);
    if base < f32::MIN_POSITIVE { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LightShape;
    use crate::shading::phong;

    #[test]
    fn powers_are_those_of_the_standard_library() {
        for exponent in [1e-3_f32, 0.5, 1.0, 2.0, 7.5, 32.0, 200.0, 1000.0, 2e4, 3e38] {
            for step in 0..=4000 {
                let base = step as f32 / 4000.0;
                for base in [base, 1.0 - base * 1e-3, base * 1e-6, 1.0 + base * 1e-6] {
                    let expected = base.powf(exponent).min(2.0);
                    let found = power(base, exponent).min(2.0);
                    let close = (found - expected).abs() <= 1e-5 * expected.max(1e-3);
                    assert!(close, "{base}^{exponent} is {found}, not {expected}");
                }
            }
        }
    }

    #[test]
    fn sixteen_points_have_the_colors_of_one() {
        let shiny = Material {
            specular: Vec3::new(0.5, 0.0, 0.9),
            shininess: 20.0,
            ..Material::matt(Vec3::new(0.2, 0.7, 0.4))
        };
        let materials = [shiny, Material::matt(Vec3::ONE), Material { shininess: 3.0, ..shiny }];
        let shape = LightShape::Point(Vec3::Y);
        let light = Light { specular: Vec3::splat(0.7), ..Light::new(shape, Vec3::splat(1.5)) };
        let mut highlights = 0;
        for round in 0..200 {
            let dir = |of: usize, lane: usize| {
                let turn = (round * 48 + 3 * lane + of) as f32;
                let dir =
                    Vec3::new((turn * 1.3).sin(), 0.6 + (turn * 0.7).sin(), (turn * 2.9).cos());
                if lane == 5 && of == 1 { Vec3::NAN } else { dir.normalize() }
            };
            let vectors = |of: usize| -> Vectors {
                each(|axis| F32x16::new(std::array::from_fn(|lane| dir(of, lane)[axis])))
            };
            let numbers: [u32; LANES] =
                std::array::from_fn(|lane| if round % 2 == 0 { 2 } else { lane as u32 % 3 });
            let [normal, to_light, to_viewer] = [vectors(0), vectors(1), vectors(2)];
            let ray = each(|axis| to_viewer[axis] * F32x16::splat(-3.0));
            let found = reflected(&light, (&materials, &numbers), &normal, &to_light, &ray);
            for lane in 0..LANES {
                let material = &materials[numbers[lane] as usize];
                let [normal, to_light, to_viewer] = [dir(0, lane), dir(1, lane), dir(2, lane)];
                let expected = phong::reflected(&light, material, normal, to_light, to_viewer);
                let found = Vec3::from(found.map(|part| part.to_array()[lane]));
                assert!((found - expected).abs().max_element() < 1e-5, "{found}, not {expected}");
                assert_eq!(found == Vec3::ZERO, expected == Vec3::ZERO);
                highlights += u32::from(expected.z > expected.y);
            }
        }
        assert!(highlights > 100, "{highlights}");
    }
}
