//! Neighbours put together: primitives sorted into the cells of a grid, so that the top of the tree
//! can be split by cells instead of primitives (after Ganestam, Barringer, Doggett, Akenine-Möller
//! 2015, "Bonsai: rapid bounding volume hierarchy generation using mini trees").
//!
//! It is a counting sort in [`parts`] parts, whose number follows from that of the primitives
//! alone, and within a cell the order stays: the same for every number of threads.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{Vec4, Vec4Swizzles};
use rayon::prelude::*;

use super::binning::{Binned, INTEGER, Range};
use super::primitive::{BuildPrimitive, SignedBox};

/// There is a cell for so many primitives, most of them empty where surfaces are.
const PER_CELL: usize = 2;
/// There are never more cells: their counters are to stay in a core's own cache.
const MAX_CELLS: usize = 1 << 19;
/// A primitive longer than so many cells is a cluster of its own: the box of its cell would be as large.
/// With 1 and 4 in its place the SAH cost differs by 0.003 of it at most.
const LONGEST: f32 = 2.0;
/// There are never more cells along one axis.
const MAX_ALONG: f64 = 1024.0;

/// A run of sorted primitives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cluster {
    pub(super) range: Range,
    pub(super) first: u32,
    pub(super) count: u32,
}

/// Primitives in an order that has neighbours together.
pub(super) struct Sorted {
    pub(super) primitives: Vec<BuildPrimitive>,
    pub(super) clusters: Vec<Cluster>,
}

impl Binned for Cluster {
    #[inline(always)]
    fn signed_box(&self) -> SignedBox {
        self.range.bounds
    }

    #[inline(always)]
    fn center(&self) -> Vec4 {
        self.range.bounds.center()
    }

    #[inline(always)]
    fn weight(&self) -> u32 {
        self.count
    }
}

/// The primitives cell by cell, then those that are too long, which have a cluster each. `range` is that
/// of all.
pub(super) fn sort(primitives: &[BuildPrimitive], range: Range) -> Sorted {
    let cells = Cells::new(range.centers, primitives.len());
    let part = primitives.len().div_ceil(parts(primitives.len()));
    let mut cell_of = Vec::new();
    let cell = |one: &BuildPrimitive| {
        if cells.suit(one) { cells.cell(one.center()) } else { cells.len() as u32 }
    };
    primitives.par_iter().map(cell).collect_into_vec(&mut cell_of);
    let mut places: Vec<Vec<u32>> = cell_of
        .par_chunks(part)
        .map(|part| {
            let mut counts = vec![0; cells.len() + 1];
            part.iter().for_each(|&cell| counts[cell as usize] += 1);
            counts
        })
        .collect();

    // Counts become the places where each part's primitives of each cell start.
    let mut runs = Vec::new();
    let mut next = 0;
    for cell in 0..=cells.len() {
        let first = next;
        for part in &mut places {
            next += std::mem::replace(&mut part[cell], next);
        }
        if cell == cells.len() {
            runs.extend((first..next).map(|place| (place, 1)));
        } else if next > first {
            runs.push((first, next - first));
        }
    }

    let order: Vec<AtomicU32> =
        (0..primitives.len()).into_par_iter().map(|_| AtomicU32::new(0)).collect();
    cell_of.par_chunks(part).zip(&mut places).enumerate().for_each(|(number, (cells, places))| {
        for (index, &cell) in (number * part..).zip(cells) {
            let place = &mut places[cell as usize];
            order[*place as usize].store(index as u32, Ordering::Relaxed);
            *place += 1;
        }
    });

    let mut sorted = Vec::new();
    let at = |index: AtomicU32| primitives[index.into_inner() as usize];
    order.into_par_iter().map(at).collect_into_vec(&mut sorted);
    let mut clusters = Vec::new();
    let cluster = |(first, count): (u32, u32)| Cluster {
        range: Range::of(&sorted[first as usize..][..count as usize]),
        first,
        count,
    };
    runs.into_par_iter().map(cluster).collect_into_vec(&mut clusters);
    Sorted { primitives: sorted, clusters }
}

/// In how many parts so many primitives are sorted.
pub(super) fn parts(primitives: usize) -> usize {
    (primitives >> 17).clamp(2, 8)
}

/// Cubes of one size that fill the box around the primitives' centres.
struct Cells {
    origin: Vec4,
    scale: Vec4,
    last: Vec4,
    along: [u32; 3],
    side: f32,
}

impl Cells {
    fn new(centers: SignedBox, primitives: usize) -> Self {
        let (origin, size) = centers.min_and_size();
        let wanted = (primitives / PER_CELL).clamp(1, MAX_CELLS) as f64;
        let sizes = [size.x, size.y, size.z].map(|size| f64::from(size).min(1e39));
        let mut side = sizes.into_iter().fold(f64::MIN_POSITIVE, f64::max) / MAX_ALONG;
        let along = loop {
            let along = sizes.map(|size| (size / side).ceil().max(1.0));
            if along.iter().product::<f64>() <= wanted {
                break along;
            }
            side *= 1.05;
        };
        let scale = sizes.map(|size| (1.0 / side).min(MAX_ALONG / size) as f32);
        let scale = scale.map(|scale| if scale.is_finite() { scale } else { 0.0 });
        let last = along.map(|along| INTEGER + along as f32 - 1.0);
        Self {
            origin,
            scale: Vec4::new(scale[0], scale[1], scale[2], 0.0),
            last: Vec4::new(last[0], last[1], last[2], INTEGER),
            along: along.map(|along| along as u32),
            side: side as f32,
        }
    }

    fn len(&self) -> usize {
        self.along.iter().product::<u32>() as usize
    }

    /// False if this one is too long to be put with others.
    #[inline(always)]
    fn suit(&self, one: &BuildPrimitive) -> bool {
        one.signed_box().min_and_size().1.xyz().max_element() <= LONGEST * self.side
    }

    #[inline(always)]
    fn cell(&self, center: Vec4) -> u32 {
        // As in `Grid::place`: rounded down, a NaN becomes 0.
        let place = (center - self.origin) * self.scale + Vec4::splat(INTEGER - 0.5);
        let place = place.max(Vec4::splat(INTEGER)).min(self.last);
        let [x, y, z, _] = place.to_array().map(|along| along.to_bits() - INTEGER.to_bits());
        x + self.along[0] * (y + self.along[1] * z)
    }
}
