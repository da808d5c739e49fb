//! Vectors of lanes, for culling alone: products may round once or twice.

use crate::simd::Lanes;

/// `a + b`.
#[inline(always)]
pub(super) fn add<F: Lanes>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`.
#[inline(always)]
pub(super) fn sub<F: Lanes>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The inner product, fused or not.
#[inline(always)]
pub(super) fn dot<F: Lanes>(a: [F; 3], b: [F; 3]) -> F {
    a[0].mul_add_fast(b[0], a[1].mul_add_fast(b[1], a[2] * b[2]))
}

/// The outer product, fused or not.
#[inline(always)]
pub(super) fn cross<F: Lanes>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    let part = |i: usize, j: usize| a[i].mul_add_fast(b[j], -(a[j] * b[i]));
    [part(1, 2), part(2, 0), part(0, 1)]
}
