//! Rays in rows: three numbers side by side for each, as arrays of other programs have them; and what a
//! batch query reads, which is either these or [`Rays`].
//!
//! Rows are turned while they are traced, a register of rays at a time: a batch is read once, and nothing
//! of it is written before its hits are.

use crate::error::ShapeError;
use crate::ray::{Ray, Rays};
use crate::simd::{Lanes, each};

/// The most lanes of a register of rays.
pub(crate) const BLOCK: usize = 16;

/// Origins or directions.
#[derive(Clone, Copy, Debug)]
pub enum Rows<'a> {
    /// One for all rays.
    Same([f32; 3]),
    /// One a ray.
    F32(&'a [[f32; 3]]),
    /// One a ray, each number rounded to the nearest float as it is read.
    F64(&'a [[f64; 3]]),
}

/// Where rays begin to look for hits, or end: `t` in lengths of their directions.
#[derive(Clone, Copy, Debug)]
pub enum Ends<'a> {
    /// One for all rays.
    Same(f32),
    /// One a ray.
    F32(&'a [f32]),
    /// One a ray, rounded to the nearest float as it is read.
    F64(&'a [f64]),
}

/// Rays in rows that somebody else owns.
#[derive(Clone, Copy, Debug)]
pub struct RayRows<'a> {
    len: usize,
    origins: Rows<'a>,
    dirs: Rows<'a>,
    t_min: Ends<'a>,
    t_max: Ends<'a>,
}

impl<'a> RayRows<'a> {
    /// So many rays.
    ///
    /// # Errors
    /// [`ShapeError`] names the first array that has not one entry a ray.
    pub fn new(
        len: usize,
        origins: Rows<'a>,
        dirs: Rows<'a>,
        t_min: Ends<'a>,
        t_max: Ends<'a>,
    ) -> Result<Self, ShapeError> {
        let lengths = [
            ("origins", origins.len()),
            ("dirs", dirs.len()),
            ("t_min", t_min.len()),
            ("t_max", t_max.len()),
        ];
        for (name, found) in lengths {
            ShapeError::check(name, found.unwrap_or(len), "rays", len)?;
        }
        Ok(Self { len, origins, dirs, t_min, t_max })
    }

    /// The eight fields of up to a register of rays from `start` on, in the order of [`Rays`]; the lanes
    /// after them hold zeros or what all rays share.
    #[inline(always)]
    pub(crate) fn lanes<F: Lanes>(&self, start: usize, count: usize) -> [F; 8] {
        let [x, y, z] = self.origins.lanes(start, count);
        let [dx, dy, dz] = self.dirs.lanes(start, count);
        let (t_min, t_max) = (self.t_min.lanes(start, count), self.t_max.lanes(start, count));
        [x, y, z, dx, dy, dz, t_min, t_max]
    }

    /// The memory of some rays in eight pieces of nearly one length.
    pub(crate) fn pieces(&self, start: usize, end: usize) -> [&'a [f32]; 8] {
        let (start, end) = (start.min(self.len), end.min(self.len));
        let mut pieces = [[].as_slice(); 8];
        let both = [self.origins.memory(start, end), self.dirs.memory(start, end)];
        let sizes = match both {
            [_, []] => [8, 0],
            [[], _] => [0, 8],
            _ => [4, 4],
        };
        let mut free = pieces.iter_mut();
        for (memory, count) in both.into_iter().zip(sizes) {
            let len = memory.len().div_ceil(count.max(1)).max(1);
            for (piece, of) in free.by_ref().take(count).zip(memory.chunks(len)) {
                *piece = of;
            }
        }
        pieces
    }
}

impl<'a> Rows<'a> {
    fn len(&self) -> Option<usize> {
        match self {
            Self::Same(_) => None,
            Self::F32(rows) => Some(rows.len()),
            Self::F64(rows) => Some(rows.len()),
        }
    }

    #[inline(always)]
    fn get(&self, index: usize) -> [f32; 3] {
        match self {
            Self::Same(row) => *row,
            Self::F32(rows) => rows[index],
            Self::F64(rows) => rows[index].map(|value| value as f32),
        }
    }

    fn range(&self, start: usize, end: usize) -> Self {
        match self {
            Self::Same(row) => Self::Same(*row),
            Self::F32(rows) => Self::F32(&rows[start..end]),
            Self::F64(rows) => Self::F64(&rows[start..end]),
        }
    }

    fn memory(&self, start: usize, end: usize) -> &'a [f32] {
        match self {
            Self::Same(_) => &[],
            Self::F32(rows) => rows[start..end].as_flattened(),
            Self::F64(rows) => bytemuck::cast_slice(rows[start..end].as_flattened()),
        }
    }

    #[inline(always)]
    fn lanes<F: Lanes>(&self, start: usize, count: usize) -> [F; 3] {
        match self {
            Self::Same(row) => row.map(F::splat),
            Self::F32(rows) if count == F::LANES => F::load_rows(&rows[start..start + F::LANES]),
            _ => {
                let mut some = [[0.0; 3]; BLOCK];
                for (lane, row) in some[..count].iter_mut().enumerate() {
                    *row = self.get(start + lane);
                }
                F::load_rows(&some)
            }
        }
    }
}

impl Ends<'_> {
    fn len(&self) -> Option<usize> {
        match self {
            Self::Same(_) => None,
            Self::F32(ends) => Some(ends.len()),
            Self::F64(ends) => Some(ends.len()),
        }
    }

    #[inline(always)]
    fn get(&self, index: usize) -> f32 {
        match self {
            Self::Same(end) => *end,
            Self::F32(ends) => ends[index],
            Self::F64(ends) => ends[index] as f32,
        }
    }

    fn range(&self, start: usize, end: usize) -> Self {
        match self {
            Self::Same(same) => Self::Same(*same),
            Self::F32(ends) => Self::F32(&ends[start..end]),
            Self::F64(ends) => Self::F64(&ends[start..end]),
        }
    }

    #[inline(always)]
    fn lanes<F: Lanes>(&self, start: usize, count: usize) -> F {
        match self {
            Self::Same(end) => F::splat(*end),
            Self::F32(ends) if count == F::LANES => F::load(&ends[start..]),
            _ => {
                let mut some = [0.0; BLOCK];
                for (lane, end) in some[..count].iter_mut().enumerate() {
                    *end = self.get(start + lane);
                }
                F::load(&some)
            }
        }
    }
}

/// The rays of a batch query.
#[derive(Clone, Copy, Debug)]
pub enum BatchRays<'a> {
    /// Field by field.
    Arrays(Rays<'a>),
    /// Ray by ray.
    Rows(RayRows<'a>),
}

impl<'a> From<Rays<'a>> for BatchRays<'a> {
    fn from(rays: Rays<'a>) -> Self {
        Self::Arrays(rays)
    }
}

impl<'a> From<RayRows<'a>> for BatchRays<'a> {
    fn from(rays: RayRows<'a>) -> Self {
        Self::Rows(rays)
    }
}

impl BatchRays<'_> {
    /// How many rays there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Arrays(rays) => rays.len(),
            Self::Rows(rays) => rays.len,
        }
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Ray `index`. Panics if there is none.
    pub fn get(&self, index: usize) -> Ray {
        match self {
            Self::Arrays(rays) => rays.get(index),
            Self::Rows(rays) => Ray {
                origin: rays.origins.get(index).into(),
                dir: rays.dirs.get(index).into(),
                t_min: rays.t_min.get(index),
                t_max: rays.t_max.get(index),
            },
        }
    }

    /// The rays from `start` up to `end`. Panics if they are out of range.
    pub fn range(&self, start: usize, end: usize) -> Self {
        match self {
            Self::Arrays(rays) => Self::Arrays(rays.range(start, end)),
            Self::Rows(rays) => Self::Rows(RayRows {
                len: end - start,
                origins: rays.origins.range(start, end),
                dirs: rays.dirs.range(start, end),
                t_min: rays.t_min.range(start, end),
                t_max: rays.t_max.range(start, end),
            }),
        }
    }

    /// The origins, or else the directions, of up to [`BLOCK`] rays from `start` on, axis by axis.
    #[inline(always)]
    pub(crate) fn block(&self, origins: bool, start: usize, count: usize) -> [[f32; BLOCK]; 3] {
        let mut block = [[0.0; BLOCK]; 3];
        match self {
            Self::Arrays(rays) => {
                let fields = rays.arrays();
                let fields = if origins { &fields[..3] } else { &fields[3..6] };
                for (to, from) in block.iter_mut().zip(fields) {
                    to[..count].copy_from_slice(&from[start..start + count]);
                }
            }
            Self::Rows(rays) => {
                let rows = if origins { &rays.origins } else { &rays.dirs };
                for (lane, index) in (start..start + count).enumerate() {
                    let row = rows.get(index);
                    for (to, value) in block.iter_mut().zip(row) {
                        to[lane] = value;
                    }
                }
            }
        }
        block
    }

    /// Gives each ray by its number and its eight fields in the order of [`Rays`].
    #[inline(always)]
    pub(crate) fn for_each(&self, mut give: impl FnMut(usize, [f32; 8])) {
        match self {
            Self::Arrays(rays) => {
                let fields = rays.arrays();
                for index in 0..rays.len() {
                    give(index, each(|field| fields[field][index]));
                }
            }
            Self::Rows(rays) => {
                for index in 0..rays.len {
                    let ([x, y, z], [dx, dy, dz]) = (rays.origins.get(index), rays.dirs.get(index));
                    let (t_min, t_max) = (rays.t_min.get(index), rays.t_max.get(index));
                    give(index, [x, y, z, dx, dy, dz, t_min, t_max]);
                }
            }
        }
    }
}
