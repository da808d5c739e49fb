//! What the builder knows of a primitive: its box, its kind, its id, in one register of eight lanes.

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::binning::Binned;
use super::node::PrimKind;
use crate::geometry::Aabb;
use crate::simd::{F32x8, Lanes};

/// A box in eight lanes, `min.xyz, _, -max.xyz, _`: so the union of two boxes is one minimum. What
/// the two other lanes hold takes part and means nothing, but is never NaN nor denormal.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct SignedBox(F32x8);

impl SignedBox {
    /// The box that holds nothing.
    pub(super) fn empty() -> Self {
        Self(F32x8::splat(f32::INFINITY))
    }

    /// The box around one point.
    #[inline(always)]
    pub(super) fn of_point(point: Vec4) -> Self {
        Self::join(point, -point)
    }

    /// The smallest box around these points.
    #[inline(always)]
    pub(super) fn of_points(points: &[Vec3]) -> Self {
        let mut all = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        for point in points {
            let point = point.extend(0.0);
            all = (all.0.min(point), all.1.max(point));
        }
        Self::join(all.0, -all.1)
    }

    pub(super) fn of_aabb(bounds: &Aabb) -> Self {
        Self::join(bounds.min.extend(0.0), (-bounds.max).extend(0.0))
    }

    /// The smallest box around both.
    #[inline(always)]
    pub(super) fn union(self, other: Self) -> Self {
        Self(Lanes::min(self.0, other.0))
    }

    /// The same box as two corners.
    pub(super) fn aabb(self) -> Aabb {
        let (min, negative_max) = self.halves();
        Aabb { min: min.xyz(), max: -negative_max.xyz() }
    }

    /// The smallest corner and the size.
    pub(super) fn min_and_size(self) -> (Vec4, Vec4) {
        let (min, negative_max) = self.halves();
        (min, -negative_max - min)
    }

    /// Half the surface area of the box times `scale` squared; 0 for the empty box. The scale comes
    /// first, so that areas stay finite where it is the inverse of the scene's extent.
    #[inline(always)]
    pub(super) fn half_area(self, scale: f32) -> f32 {
        let (min, negative_max) = self.halves();
        let size = (-negative_max * scale - min * scale).max(Vec4::ZERO);
        let products = size * size.yzxw();
        products.x + products.y + products.z
    }

    /// Its centre, halved first so that it does not overflow.
    #[inline(always)]
    pub(super) fn center(self) -> Vec4 {
        let (min, negative_max) = self.halves();
        min * 0.5 - negative_max * 0.5
    }

    /// True if it lies in `other`, and is at least half as long where that is longest.
    pub(super) fn nearly_fills(self, other: Self) -> bool {
        let longest = |of: Self| of.min_and_size().1.xyz().max_element();
        let both = self.union(other).aabb();
        both == other.aabb() && longest(self) >= 0.5 * longest(other) && longest(other).is_finite()
    }

    /// The same box, or with infinity added the empty one.
    #[inline(always)]
    pub(super) fn plus(self, offset: F32x8) -> Self {
        Self(self.0 + offset)
    }

    #[inline(always)]
    fn join(low: Vec4, high: Vec4) -> Self {
        Self(F32x8::new([low.x, low.y, low.z, low.w, high.x, high.y, high.z, high.w]))
    }

    #[inline(always)]
    fn halves(self) -> (Vec4, Vec4) {
        let lanes = self.0.to_array();
        (Vec4::from_slice(&lanes[..4]), Vec4::from_slice(&lanes[4..]))
    }
}

/// What the builder knows of a primitive.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct BuildPrimitive(SignedBox);

const _: () = assert!(size_of::<BuildPrimitive>() == 32);

/// The kind's number in the last lane of a primitive that is to be left out.
pub(super) const LEFT_OUT: u32 = 3;

/// Added to numbers below `2^26`, this makes them the bits of floats from 2 up: as the bits of a
/// denormal they would make each product a hundred times slower.
const NORMAL: u32 = 0x4000_0000;

/// A small number as the bits of a float.
#[inline(always)]
fn in_float(number: u32) -> f32 {
    f32::from_bits(NORMAL + number)
}

/// The inverse of [`in_float`].
#[inline(always)]
fn from_float(float: f32) -> u32 {
    float.to_bits() - NORMAL
}

impl BuildPrimitive {
    /// A primitive with a box around it. The box must be finite, the id at most
    /// [`MAX_PRIMITIVES`](super::MAX_PRIMITIVES).
    #[inline(always)]
    pub fn new(bounds: Aabb, kind: PrimKind, id: u32) -> Self {
        debug_assert!(bounds.min.is_finite() && bounds.max.is_finite());
        let min = bounds.min.extend(in_float(id));
        Self(SignedBox::join(min, (-bounds.max).extend(in_float(kind as u32))))
    }

    /// A triangle; [`BuildPrimitive::left_out`] if no ray can ever see an area, because two corners
    /// are one point or a coordinate is not finite.
    #[inline(always)]
    pub fn of_triangle(corners: &[Vec3; 3], id: u32) -> Self {
        let [a, b, c] = corners.map(|corner| corner.extend(0.0));
        // Zero times a number that is not finite is NaN.
        let is_finite = (a * 0.0 + b * 0.0 + c * 0.0).cmpeq(Vec4::ZERO).all();
        let is_point = a.cmpeq(b).all() | b.cmpeq(c).all() | c.cmpeq(a).all();
        if !is_finite | is_point {
            return Self::left_out();
        }
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        let kind = in_float(PrimKind::Triangle as u32);
        Self(SignedBox::join(min.with_w(in_float(id)), (-max).with_w(kind)))
    }

    /// Stands for a primitive that the tree leaves out.
    pub fn left_out() -> Self {
        Self(SignedBox::join(Vec4::ONE, Vec4::ONE.with_w(in_float(LEFT_OUT))))
    }

    /// True if it is [`BuildPrimitive::left_out`].
    pub fn is_left_out(&self) -> bool {
        from_float(self.0.0.lane(7)) == LEFT_OUT
    }

    /// Its kind and id, whatever the id is if it is [`BuildPrimitive::left_out`].
    #[inline(always)]
    pub(super) fn key(&self) -> PrimitiveKey {
        PrimitiveKey(from_float(self.0.0.lane(7)) << 26 | self.id() & PrimitiveKey::ID)
    }

    /// The smallest and the largest number of a kind, with [`LEFT_OUT`] for those.
    #[inline(always)]
    pub(super) fn kind_numbers(primitives: &[Self]) -> [u32; 2] {
        let last = |one: &Self| from_float(one.0.0.lane(7));
        primitives
            .iter()
            .map(last)
            .fold([LEFT_OUT, 0], |[min, max], kind| [min.min(kind), max.max(kind)])
    }

    /// Its box.
    pub fn bounds(&self) -> Aabb {
        self.0.aabb()
    }

    /// Its kind.
    pub fn kind(&self) -> PrimKind {
        PrimKind::ALL[from_float(self.0.0.lane(7)) as usize]
    }

    /// Its id.
    #[inline(always)]
    pub fn id(&self) -> u32 {
        from_float(self.0.0.lane(3))
    }
}

/// What is left of a primitive without its box: its kind and its id.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PrimitiveKey(u32);

const _: () = assert!(super::MAX_PRIMITIVES < 1 << 26);

impl PrimitiveKey {
    /// The bits of an id.
    const ID: u32 = (1 << 26) - 1;

    #[inline(always)]
    pub(super) fn of(primitive: &BuildPrimitive) -> Self {
        Self::new(primitive.kind(), primitive.id())
    }

    /// True if it is the key of [`BuildPrimitive::left_out`].
    pub(super) fn is_left_out(self) -> bool {
        self.0 >> 26 == LEFT_OUT
    }

    #[inline(always)]
    pub(super) fn new(kind: PrimKind, id: u32) -> Self {
        Self((kind as u32) << 26 | id)
    }

    /// Bits that compare as `(kind, id)` do.
    #[inline(always)]
    pub(super) fn bits(self) -> u32 {
        self.0
    }

    /// The inverse of [`PrimitiveKey::bits`].
    #[inline(always)]
    pub(super) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub(super) fn kind(self) -> PrimKind {
        PrimKind::ALL[(self.0 >> 26) as usize]
    }

    #[inline(always)]
    pub(super) fn id(self) -> u32 {
        self.0 & Self::ID
    }
}

impl Binned for BuildPrimitive {
    #[inline(always)]
    fn signed_box(&self) -> SignedBox {
        self.0
    }

    #[inline(always)]
    fn center(&self) -> Vec4 {
        self.0.center()
    }

    #[inline(always)]
    fn weight(&self) -> u32 {
        1
    }
}
