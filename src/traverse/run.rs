//! A run: rays that were put in order, right before they are traced, and where what they find is to go.

use crate::batch_rays::{BatchRays, Start};
use crate::ray::RayBatch;

/// The bits that order the rays of a bucket.
pub(super) const CELL_BITS: u32 = 11;
pub(super) const CELLS: usize = 1 << CELL_BITS;

/// How many numbers a row has: all fields of a ray in the order of [`crate::Rays`], or its direction if
/// that is all in which rays differ, and last the bits of what orders it in its bucket.
pub(super) const ALL: usize = 8 + 1;
pub(super) const DIRS: usize = 3 + 1;

/// Rays in order, and their places in the buckets.
#[derive(Default)]
pub(super) struct Run {
    /// What the rays have in common but for their directions, which then are all that there is of them.
    shared: Option<Start>,
    dirs: Vec<[f32; 3]>,
    rays: RayBatch,
    pub(super) places: Vec<u32>,
}

impl Run {
    /// No rays. Those to come have this in common.
    pub(super) fn new(shared: Option<Start>) -> Self {
        Self { shared, ..Self::default() }
    }

    pub(super) fn clear(&mut self) {
        self.dirs.clear();
        self.rays.clear();
        self.places.clear();
    }

    pub(super) fn rays(&self) -> BatchRays<'_> {
        match &self.shared {
            Some(start) => start.with(&self.dirs).into(),
            None => self.rays.as_rays().into(),
        }
    }

    /// Appends the rays of one bucket, which come part by part, as rows of directions or of all fields,
    /// each with the bits of what orders it; the first one has place `place`.
    pub(super) fn add<'a>(&mut self, parts: impl Iterator<Item = &'a [f32]> + Clone, place: u32) {
        let mut ends = [0_u32; CELLS];
        let width = if self.shared.is_some() { DIRS } else { ALL };
        for rows in parts.clone() {
            rows.chunks_exact(width).for_each(|row| ends[cell_of(row[width - 1])] += 1);
        }
        let mut next = self.places.len() as u32;
        for end in &mut ends {
            (*end, next) = (next, next + *end);
        }
        let count = next as usize;
        self.places.resize(count, 0);
        let order = Order { ends, place, places: &mut self.places };
        if self.shared.is_some() {
            self.dirs.resize(count, [0.0; 3]);
            order.give::<DIRS>(parts, |end, &[x, y, z, _]| self.dirs[end] = [x, y, z]);
            return;
        }
        let rays = &mut self.rays;
        let mut fields = [
            &mut rays.origin_x,
            &mut rays.origin_y,
            &mut rays.origin_z,
            &mut rays.dir_x,
            &mut rays.dir_y,
            &mut rays.dir_z,
            &mut rays.t_min,
            &mut rays.t_max,
        ]
        .map(|field| {
            field.resize(count, 0.0);
            &mut field[..]
        });
        order.give::<ALL>(parts, |end, row| {
            for (field, &value) in fields.iter_mut().zip(row) {
                field[end] = value;
            }
        });
    }
}

/// Where the next ray of each cell goes, and which place it has.
struct Order<'a> {
    ends: [u32; CELLS],
    place: u32,
    places: &'a mut [u32],
}

impl Order<'_> {
    /// Gives each row with where it goes.
    #[inline(always)]
    fn give<'a, const WIDTH: usize>(
        mut self,
        parts: impl Iterator<Item = &'a [f32]>,
        mut give: impl FnMut(usize, &[f32; WIDTH]),
    ) {
        for rows in parts {
            for row in rows.as_chunks::<WIDTH>().0 {
                let end = &mut self.ends[cell_of(row[WIDTH - 1])];
                give(*end as usize, row);
                self.places[*end as usize] = self.place;
                (*end, self.place) = (*end + 1, self.place + 1);
            }
        }
    }
}

/// What orders a ray in its bucket, by the last number of its row.
#[inline(always)]
fn cell_of(last: f32) -> usize {
    last.to_bits() as usize % CELLS
}
