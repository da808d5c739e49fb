//! The order of primitives along a curve, found by digits of their places, the last first, in parts
//! whose number follows from that of the primitives alone: the same for every number of threads.

use rayon::prelude::*;

use super::PrimitiveSource;
use super::binning::{Binned, Range};
use super::build::CHUNK;
use super::curve::{Curve, FEW, MOST_BITS};
use super::marks::Mark;
use super::primitive::{BuildPrimitive, LEFT_OUT, PrimitiveKey, SignedBox};

/// The bits of a digit; the last one has a bit more.
const DIGIT: u32 = 11;

/// More primitives get a third digit. With fewer, trees are made later by 5% for it, and rays are as fast.
const MANY: usize = 1 << 21;

/// The primitives in the order of the curve.
pub(super) struct Sorted {
    pub(super) marks: Vec<Mark>,
    /// The box around all primitives, and the one around their centres.
    pub(super) range: Range,
    /// A bit for each kind that there is.
    pub(super) kinds: u32,
}

/// Sorts the primitives with ids below `ids`, except those that a tree leaves out.
pub(super) fn sort(source: &impl PrimitiveSource, ids: usize) -> Sorted {
    // Centres are needed to place centres. If the guess is good, once is enough.
    let guess = SignedBox::of_aabb(&source.guess());
    let digits = if ids > MANY { 3 } else { 2 };
    let bits = (digits * DIGIT).min(MOST_BITS);
    // Both write to new memory, which takes longer than the work on it: together they keep all threads busy.
    let ((mut marks, survey), mut other) =
        rayon::join(|| mark(source, ids, &Curve::new(guess, bits)), || blank(ids));
    if survey.left_out > 0 || !survey.range.centers.nearly_fills(guess) {
        if survey.left_out == ids {
            marks.clear();
        } else {
            marks = mark(source, ids, &Curve::new(survey.range.centers, bits)).0;
        }
        if survey.left_out > 0 {
            marks.retain(|mark| !mark.key().is_left_out());
        }
        other.truncate(marks.len());
    }
    for digit in 0..digits {
        by_digit(&marks, &other, digit * DIGIT, digit + 1 == digits);
        std::mem::swap(&mut marks, &mut other);
    }
    Sorted { marks, range: survey.range, kinds: survey.kinds }
}

/// The marks of all primitives in the order of their ids, and what there is to know of them.
fn mark(source: &impl PrimitiveSource, ids: usize, curve: &Curve) -> (Vec<Mark>, Survey) {
    let marks = blank(ids);
    let chunk = |(chunk, marks): (usize, &[Mark])| {
        let mut boxes = [BuildPrimitive::left_out(); SOME];
        let mut survey = Survey::empty();
        for (some, marks) in marks.chunks(SOME).enumerate() {
            let boxes = &mut boxes[..marks.len()];
            source.boxes((chunk * CHUNK + some * SOME) as u32, boxes);
            survey = survey.union(Survey::of(boxes));
            for (boxes, marks) in boxes.chunks(FEW).zip(marks.chunks(FEW)) {
                mark_few(boxes, marks, curve);
            }
        }
        survey
    };
    let survey =
        marks.par_chunks(CHUNK).enumerate().map(chunk).reduce(Survey::empty, Survey::union);
    (marks, survey)
}

/// So many marks that mean nothing yet.
fn blank(marks: usize) -> Vec<Mark> {
    (0..marks).into_par_iter().map(|_| Mark::new(0, PrimitiveKey::default())).collect()
}

/// So many boxes are made at once, and stay in the nearest cache.
const SOME: usize = 128;

/// Marks at most [`FEW`] primitives.
#[inline(always)]
fn mark_few(boxes: &[BuildPrimitive], marks: &[Mark], curve: &Curve) {
    let mut centers = [[0.0; FEW]; 3];
    for (place, one) in boxes.iter().enumerate() {
        let center = one.center();
        for (axis, centers) in centers.iter_mut().enumerate() {
            centers[place % FEW] = center[axis];
        }
    }
    for ((one, mark), place) in boxes.iter().zip(marks).zip(curve.places(&centers)) {
        mark.set(place | curve.after(one.signed_box()), one.key());
    }
}

/// What is to be known of all primitives together.
struct Survey {
    range: Range,
    kinds: u32,
    left_out: usize,
}

impl Survey {
    fn empty() -> Self {
        Self { range: Range::empty(), kinds: 0, left_out: 0 }
    }

    fn of(boxes: &[BuildPrimitive]) -> Self {
        let [first, last] = BuildPrimitive::kind_numbers(boxes);
        if first == last && last != LEFT_OUT {
            return Self { range: Range::of(boxes), kinds: 1 << first, left_out: 0 };
        }
        let mut survey = Self::empty();
        for one in boxes {
            if one.is_left_out() {
                survey.left_out += 1;
            } else {
                survey.range = survey.range.union(Range::of(std::slice::from_ref(one)));
                survey.kinds |= 1 << one.kind() as u32;
            }
        }
        survey
    }

    fn union(self, other: Self) -> Self {
        Self {
            range: self.range.union(other.range),
            kinds: self.kinds | other.kinds,
            left_out: self.left_out + other.left_out,
        }
    }
}

/// Sorts `from` by one digit into `to`; what has the same digit keeps its order.
fn by_digit(from: &[Mark], to: &[Mark], shift: u32, is_last: bool) {
    const VALUES: usize = 2 << DIGIT;
    // A power of two, so that threads get alike; the counts of more would take long to add up.
    let parts = (from.len() >> 15).next_power_of_two().clamp(4, 8);
    let part = from.len().div_ceil(parts).max(1);
    let values = if is_last { VALUES } else { VALUES / 2 };
    let digit = |mark: &Mark| (mark.place() >> shift) as usize & (values - 1) & (VALUES - 1);
    let count = |part: &[Mark]| {
        let mut counts = [0_u32; VALUES];
        part.iter().for_each(|mark| counts[digit(mark)] += 1);
        counts
    };
    let mut places: Vec<[u32; VALUES]> = from.par_chunks(part).map(count).collect();
    let mut next = 0;
    for value in 0..values {
        for part in &mut places {
            next += std::mem::replace(&mut part[value], next);
        }
    }
    from.par_chunks(part).zip(&mut places).for_each(|(part, places)| {
        for mark in part {
            let place = &mut places[digit(mark)];
            to[*place as usize].copy(mark);
            *place += 1;
        }
    });
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bvh::PrimKind;
    use crate::geometry::Aabb;

    /// Points, of which those that are NaN are to be left out, and a guess where they are.
    struct Points<'a>(&'a [Vec3], Aabb);

    impl PrimitiveSource for Points<'_> {
        fn guess(&self) -> Aabb {
            self.1
        }
        fn boxes(&self, first: u32, into: &mut [BuildPrimitive]) {
            for (one, id) in into.iter_mut().zip(first..) {
                let point = self.0[id as usize];
                *one = match point.is_nan() {
                    true => BuildPrimitive::left_out(),
                    false => BuildPrimitive::new(Aabb::of_points(&[point]), PrimKind::Sphere, id),
                };
            }
        }
        fn triangle(&self, _: u32) -> [Vec3; 3] {
            unreachable!("all are spheres")
        }
        fn quad(&self, _: u32) -> [Vec3; 4] {
            unreachable!("all are spheres")
        }
        fn sphere(&self, id: u32) -> (Vec3, f32) {
            (self.0[id as usize], 0.0)
        }
    }

    /// Places and ids in order, the same for all guesses.
    fn sorted(points: &[Vec3]) -> Vec<(u32, u32)> {
        let kept: Vec<Vec3> = points.iter().copied().filter(|point| !point.is_nan()).collect();
        let around = Aabb::of_points(&kept);
        let size = around.max - around.min;
        let far = Aabb { min: around.min - size * 2.0, max: around.max };
        let part = Aabb { min: around.min, max: around.max - size * 0.25 };
        let all = Aabb { min: around.min, max: Vec3::INFINITY };
        let orders = [around, far, part, all, Aabb::EMPTY].map(|guess| {
            let Sorted { marks, range, kinds } = sort(&Points(points, guess), points.len());
            assert_eq!(range.centers.aabb(), around, "{guess:?}");
            assert_eq!(kinds, 1 << PrimKind::Sphere as u32);
            marks.iter().map(|mark| (mark.place(), mark.key().id())).collect::<Vec<_>>()
        });
        assert!(orders.iter().all(|order| *order == orders[0]));
        let [order, ..] = orders;
        assert!(order.is_sorted(), "equal places keep their order");
        let mut ids: Vec<u32> = order.iter().map(|one| one.1).collect();
        ids.sort_unstable();
        let kept = (0..).zip(points).filter(|(_, point)| !point.is_nan());
        assert!(ids.into_iter().eq(kept.map(|(id, _)| id)), "each once");
        order
    }

    /// The points of a lattice, the last axis first.
    fn lattice([x, y, z]: [u32; 3]) -> Vec<Vec3> {
        let at = |place| [place / z / y % x, place / z % y, place % z];
        (0..x * y * z).map(|place| Vec3::from_array(at(place).map(|along| along as f32))).collect()
    }

    #[test]
    fn places_are_interleaved_bits() {
        let points = lattice([16, 16, 16]);
        let place = |point: Vec3| {
            let bit = |level: u32| {
                (0..3)
                    .map(move |axis| (point[axis] as u32 >> level & 1) << (3 * level + axis as u32))
            };
            (0..4).flat_map(bit).sum::<u32>()
        };
        for ((_, id), number) in sorted(&points).into_iter().zip(0..) {
            assert_eq!(place(points[id as usize]), number);
        }
    }

    #[test]
    fn flat_and_long_scenes_have_as_many_cells() {
        for sides in [[300, 300, 1], [1, 400, 200], [60_000, 1, 1], [2000, 5, 5]] {
            let mut points = lattice(sides);
            points.reverse();
            let mut places: Vec<u32> = sorted(&points).into_iter().map(|one| one.0).collect();
            places.dedup();
            assert_eq!(places.len() as u32, sides.iter().product::<u32>(), "{sides:?}");
        }
        sorted(&[Vec3::ONE; 1000]);
        sorted(&[Vec3::splat(-1e38), Vec3::splat(1e38), Vec3::ZERO]);
    }

    #[test]
    fn what_is_left_out_has_no_mark() {
        let mut points = lattice([30, 20, 10]);
        points.iter_mut().step_by(7).for_each(|point| *point = Vec3::NAN);
        assert_eq!(sorted(&points).len(), 6000 - 858);
        let none = [Vec3::NAN; 9];
        assert!(sort(&Points(&none, Aabb::EMPTY), none.len()).marks.is_empty());
    }
}
