//! Primitives as marks on a curve: which they are, and where; and where a run of marks falls apart.

use std::sync::atomic::{AtomicU64, Ordering};

use super::node::{MAX_LEAF, PrimKind};
use super::primitive::PrimitiveKey;

/// A primitive and its place on the curve. Atomic, so that threads can sort without being told
/// which of them writes where.
pub(super) struct Mark(AtomicU64);

impl Mark {
    #[inline(always)]
    pub(super) fn new(place: u32, key: PrimitiveKey) -> Self {
        Self(AtomicU64::new(bits(place, key)))
    }

    #[inline(always)]
    pub(super) fn set(&self, place: u32, key: PrimitiveKey) {
        self.0.store(bits(place, key), Ordering::Relaxed);
    }

    /// Becomes the same as another.
    #[inline(always)]
    pub(super) fn copy(&self, other: &Self) {
        self.0.store(other.bits(), Ordering::Relaxed);
    }

    #[inline(always)]
    fn bits(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// The number of its cell on the curve.
    #[inline(always)]
    pub(super) fn place(&self) -> u32 {
        (self.bits() >> 32) as u32
    }

    /// Which primitive it is.
    #[inline(always)]
    pub(super) fn key(&self) -> PrimitiveKey {
        PrimitiveKey::from_bits(self.bits() as u32)
    }
}

#[inline(always)]
fn bits(place: u32, key: PrimitiveKey) -> u64 {
    u64::from(place) << 32 | u64::from(key.bits())
}

/// Where sorted marks, at least two, fall into two halves of a box of cells; in the middle if all are
/// in one cell.
#[inline(always)]
pub(super) fn middle(marks: &[Mark]) -> usize {
    let (first, last) = (marks[0].place(), marks[marks.len() - 1].place());
    if first == last {
        return marks.len() / 2;
    }
    let bit = 1 << (first ^ last).ilog2();
    marks.partition_point(|mark| mark.place() & bit == 0)
}

/// Where few sorted marks, more than a leaf holds, are furthest apart along the curve, of the places
/// that make no more leaves than they need.
#[inline(always)]
pub(super) fn middle_of_few(marks: &[Mark]) -> usize {
    let leaves = marks.len().div_ceil(MAX_LEAF);
    let spare = leaves * MAX_LEAF - marks.len();
    let (mut best, mut largest) = (0, None);
    for full in (MAX_LEAF..leaves * MAX_LEAF).step_by(MAX_LEAF) {
        for middle in full - spare..=full {
            let apart = Some(marks[middle - 1].place() ^ marks[middle].place());
            if apart > largest {
                (best, largest) = (middle, apart);
            }
        }
    }
    best
}

/// How many marks are of each kind.
pub(super) fn count_kinds(marks: &[Mark]) -> [usize; 3] {
    let first = |kind: PrimKind| PrimitiveKey::new(kind, 0).bits();
    let (quads, spheres) = (first(PrimKind::Quad), first(PrimKind::Sphere));
    // Two sums in registers: counters in memory would wait for each other.
    let (mut beyond_triangles, mut beyond_quads) = (0, 0);
    for mark in marks {
        let key = mark.key().bits();
        beyond_triangles += usize::from(key >= quads);
        beyond_quads += usize::from(key >= spheres);
    }
    [marks.len() - beyond_triangles, beyond_triangles - beyond_quads, beyond_quads]
}

/// Cuts the marks, which start at `first`, into runs of at most `most`: their starts and sizes.
pub(super) fn cut(marks: &[Mark], first: usize, most: usize, runs: &mut Vec<(usize, usize)>) {
    if marks.len() <= most {
        return runs.push((first, marks.len()));
    }
    let (left, right) = marks.split_at(middle(marks));
    cut(left, first, most, runs);
    cut(right, first + left.len(), most, runs);
}

/// As [`cut`], with all threads: a search waits for memory at each step.
pub(super) fn cut_by_all(
    marks: &[Mark],
    first: usize,
    most: usize,
    runs: &mut Vec<(usize, usize)>,
) {
    if marks.len() <= 16 * most {
        return cut(marks, first, most, runs);
    }
    let (left, right) = marks.split_at(middle(marks));
    let mut others = Vec::new();
    rayon::join(
        || cut_by_all(left, first, most, runs),
        || cut_by_all(right, first + left.len(), most, &mut others),
    );
    runs.append(&mut others);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marks(places: &[u32]) -> Vec<Mark> {
        places.iter().map(|&place| Mark::new(place, PrimitiveKey::default())).collect()
    }

    #[test]
    fn runs_fall_apart_at_their_highest_bit() {
        assert_eq!(middle(&marks(&[0, 1, 2, 3, 4, 5])), 4);
        assert_eq!(middle(&marks(&[8, 9, 12, 13, 13])), 2);
        assert_eq!(middle(&marks(&[6, 7])), 1);
        assert_eq!(middle(&marks(&[5; 7])), 3);
    }

    #[test]
    fn each_kind_is_counted() {
        let mark = |(number, kind): (u32, PrimKind)| {
            Mark::new(5, PrimitiveKey::new(kind, (1 << 26) - 1 - number))
        };
        for [triangles, quads, spheres] in [[3, 0, 4], [0, 7, 0], [1, 2, 3], [0, 0, 0]] {
            let triangles = std::iter::repeat_n(PrimKind::Triangle, triangles);
            let quads = std::iter::repeat_n(PrimKind::Quad, quads);
            let spheres = std::iter::repeat_n(PrimKind::Sphere, spheres);
            let kinds: Vec<PrimKind> = spheres.chain(triangles).chain(quads).collect();
            let of = |kind: PrimKind| kinds.iter().filter(|&&one| one == kind).count();
            let expected = PrimKind::ALL.map(of);
            let marks: Vec<Mark> = (0..).zip(kinds.iter().copied()).map(mark).collect();
            assert_eq!(count_kinds(&marks), expected);
        }
    }

    #[test]
    fn all_threads_cut_alike() {
        let marks = marks(&(0..5000).map(|place| place * place / 7).collect::<Vec<u32>>());
        for most in [1, 10, 100, 1000] {
            let (mut alone, mut together) = (Vec::new(), Vec::new());
            cut(&marks, 3, most, &mut alone);
            cut_by_all(&marks, 3, most, &mut together);
            assert_eq!(together, alone, "{most}");
        }
    }

    #[test]
    fn few_fall_apart_into_full_leaves() {
        // A gap after four, another one after two, where nine would leave three leaves.
        let places = [0, 1, 64, 65, 128, 129, 130, 131, 132, 133];
        assert_eq!(middle_of_few(&marks(&places)), 4);
        assert_eq!(middle_of_few(&marks(&places[..9])), 4);
        for count in MAX_LEAF + 1..=32 {
            for gap in 0..count {
                let place = |at| if at < gap { at } else { at + 64 };
                let middle = middle_of_few(&marks(
                    &(0..count as u32).map(|at| place(at as usize) as u32).collect::<Vec<_>>(),
                ));
                let leaves = |count: usize| count.div_ceil(MAX_LEAF);
                assert_eq!(leaves(middle) + leaves(count - middle), leaves(count));
                if gap > 0 && leaves(gap) + leaves(count - gap) == leaves(count) {
                    assert_eq!(middle, gap, "{count}");
                }
            }
        }
    }
}
