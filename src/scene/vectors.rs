//! Sixteen vectors side by side, and what is computed with them: the operations of `Vec3` in its order.

use crate::simd::{F32x16, Lanes, each};

/// How many hits are looked at together.
pub(crate) const LANES: usize = 16;

/// Sixteen vectors.
pub(crate) type Vectors = [F32x16; 3];

/// The unit vectors across both, in doubles.
#[inline(always)]
pub(super) fn across(a: &Vectors, b: &Vectors) -> Vectors {
    let (a, b) = (arrays(a), arrays(b));
    let [mut x, mut y, mut z] = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let (a, b) = (doubles(&a, lane), doubles(&b, lane));
        let cross =
            [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]];
        let unit = unit_or(cross, [0.0, 0.0, 1.0]);
        (x[lane], y[lane], z[lane]) = (unit[0] as f32, unit[1] as f32, unit[2] as f32);
    }
    [F32x16::new(x), F32x16::new(y), F32x16::new(z)]
}

#[inline(always)]
pub(super) fn unit_or(vector: [f64; 3], fallback: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = vector;
    let inverse = 1.0 / (x * x + y * y + z * z).sqrt();
    let has_length = (inverse > 0.0) & (inverse < f64::INFINITY);
    each(|axis| if has_length { vector[axis] * inverse } else { fallback[axis] })
}

/// Unit vectors, and `fallback` for those that have no length.
#[inline(always)]
pub(crate) fn normalized_or(vectors: &Vectors, fallback: &Vectors) -> Vectors {
    let inverse = F32x16::splat(1.0) / Lanes::sqrt(dot(vectors, vectors));
    let has_length =
        Lanes::gt(inverse, F32x16::splat(0.0)) & Lanes::lt(inverse, F32x16::splat(f32::INFINITY));
    each(|axis| Lanes::select(has_length, vectors[axis] * inverse, fallback[axis]))
}

/// The scalar products, summed in the order of `Vec3::dot`.
#[inline(always)]
pub(crate) fn dot(a: &Vectors, b: &Vectors) -> F32x16 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn arrays(vectors: &Vectors) -> [[f32; LANES]; 3] {
    each(|axis| vectors[axis].to_array())
}

#[inline(always)]
pub(super) fn doubles(vectors: &[[f32; LANES]; 3], lane: usize) -> [f64; 3] {
    each(|axis| f64::from(vectors[axis][lane]))
}

/// The float next to `exact` on the side that the sign of `offset` says; `exact` if it has none. Written
/// without branches, which `f32::next_up` has.
#[inline(always)]
pub(super) fn next_towards(exact: f32, offset: f32) -> f32 {
    let bits = exact.to_bits();
    let down = offset < 0.0;
    let grows = (exact < 0.0) == down;
    let step = if grows { bits.wrapping_add(1) } else { bits.wrapping_sub(1) };
    let step = if exact == 0.0 { 1 | u32::from(down) << 31 } else { step };
    let stays = (offset == 0.0) | offset.is_nan() | exact.is_nan() | (exact.is_infinite() & grows);
    f32::from_bits(if stays { bits } else { step })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_float_is_that_of_the_standard_library() {
        let values = [0.0, -0.0, 1.0, -1.0, 1e-45, -1e-45, f32::MAX, f32::MIN, 3e-39, -7.5];
        for exact in values.into_iter().chain([f32::INFINITY, f32::NEG_INFINITY, f32::NAN]) {
            for offset in [1.0, -1.0, 0.0, -0.0, f32::NAN] {
                let expected = if offset > 0.0 {
                    exact.next_up()
                } else if offset < 0.0 {
                    exact.next_down()
                } else {
                    exact
                };
                let found = next_towards(exact, offset);
                assert_eq!(found.to_bits(), expected.to_bits(), "{exact} {offset}");
            }
        }
    }
}
