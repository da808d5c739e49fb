//! Rays in rows: three numbers side by side for each, as arrays of other programs have them.
//!
//! Rows are turned while they are traced, a register of rays at a time: a batch is read once, and nothing
//! of it is written before its hits are.

use crate::error::ShapeError;
use crate::ray::Ray;
use crate::simd::Lanes;

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
    pub(crate) len: usize,
    pub(crate) origins: Rows<'a>,
    pub(crate) dirs: Rows<'a>,
    pub(crate) t_min: Ends<'a>,
    pub(crate) t_max: Ends<'a>,
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

    /// The eight fields of up to a register of rays from `start` on, in the order of [`crate::Rays`]; the lanes
    /// after them hold zeros or what all rays share.
    #[inline(always)]
    pub(crate) fn lanes<F: Lanes>(&self, start: usize, count: usize) -> [F; 8] {
        let [x, y, z] = self.origins.lanes(start, count);
        let [dx, dy, dz] = self.dirs.lanes(start, count);
        let (t_min, t_max) = (self.t_min.lanes(start, count), self.t_max.lanes(start, count));
        [x, y, z, dx, dy, dz, t_min, t_max]
    }

    /// Ray `index`. Panics if there is none.
    pub(crate) fn get(&self, index: usize) -> Ray {
        Ray {
            origin: self.origins.get(index).into(),
            dir: self.dirs.get(index).into(),
            t_min: self.t_min.get(index),
            t_max: self.t_max.get(index),
        }
    }

    /// The rays from `start` up to `end`. Panics if they are out of range.
    pub(crate) fn range(&self, start: usize, end: usize) -> Self {
        Self {
            len: end - start,
            origins: self.origins.range(start, end),
            dirs: self.dirs.range(start, end),
            t_min: self.t_min.range(start, end),
            t_max: self.t_max.range(start, end),
        }
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
    pub(crate) fn get(&self, index: usize) -> [f32; 3] {
        match self {
            Self::Same(row) => *row,
            Self::F32(rows) => rows[index],
            Self::F64(rows) => rows[index].map(|value| value as f32),
        }
    }

    pub(crate) fn range(&self, start: usize, end: usize) -> Self {
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
    pub(crate) fn lanes<F: Lanes>(&self, start: usize, count: usize) -> [F; 3] {
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
    pub(crate) fn get(&self, index: usize) -> f32 {
        match self {
            Self::Same(end) => *end,
            Self::F32(ends) => ends[index],
            Self::F64(ends) => ends[index] as f32,
        }
    }

    pub(crate) fn range(&self, start: usize, end: usize) -> Self {
        match self {
            Self::Same(same) => Self::Same(*same),
            Self::F32(ends) => Self::F32(&ends[start..end]),
            Self::F64(ends) => Self::F64(&ends[start..end]),
        }
    }

    #[inline(always)]
    pub(crate) fn lanes<F: Lanes>(&self, start: usize, count: usize) -> F {
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
