//! What batch queries read: rays field by field, or ray by ray.

use crate::ray::{Ray, Rays};
use crate::rows::{BLOCK, Ends, RayRows, Rows};
use crate::simd::{F32x16, Lanes, each};

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
            Self::Rows(rays) => rays.get(index),
        }
    }

    /// The rays from `start` up to `end`. Panics if they are out of range.
    pub fn range(&self, start: usize, end: usize) -> Self {
        match self {
            Self::Arrays(rays) => Self::Arrays(rays.range(start, end)),
            Self::Rows(rays) => Self::Rows(rays.range(start, end)),
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
                    match from[start..].first_chunk() {
                        Some(from) if count == BLOCK => *to = *from,
                        _ => to[..count].copy_from_slice(&from[start..start + count]),
                    }
                }
            }
            Self::Rows(rays) => {
                let rows = if origins { &rays.origins } else { &rays.dirs };
                if count == BLOCK {
                    let lanes = rows.lanes::<F32x16>(start, count);
                    (0..3).for_each(|axis| lanes[axis].store(&mut block[axis]));
                    return block;
                }
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

    /// What a ray starts with.
    pub(crate) fn start(&self, index: usize) -> Start {
        let Ray { origin, t_min, t_max, .. } = self.get(index);
        Start { origin: origin.to_array(), t_min, t_max }
    }

    /// True if all rays start with this, bit by bit.
    pub(crate) fn all_have(&self, start: &Start) -> bool {
        let Start { origin: [x, y, z], t_min, t_max } = *start;
        match self {
            Self::Arrays(rays) => {
                let fields = [
                    (rays.origin_x, x),
                    (rays.origin_y, y),
                    (rays.origin_z, z),
                    (rays.t_min, t_min),
                    (rays.t_max, t_max),
                ];
                fields.into_iter().all(|(field, value)| all_are(field, |&of| same(of, value)))
            }
            Self::Rows(rays) => {
                let is = |row: [f32; 3]| same(row[0], x) & same(row[1], y) & same(row[2], z);
                let origins = match &rays.origins {
                    Rows::Same(row) => is(*row),
                    Rows::F32(rows) => all_are(rows, |row| is(*row)),
                    Rows::F64(rows) => all_are(rows, |row| is(row.map(|value| value as f32))),
                };
                let ends = |ends: &Ends<'_>, value: f32| match ends {
                    Ends::Same(end) => same(*end, value),
                    Ends::F32(ends) => all_are(ends, |&end| same(end, value)),
                    Ends::F64(ends) => all_are(ends, |&end| same(end as f32, value)),
                };
                origins && ends(&rays.t_min, t_min) && ends(&rays.t_max, t_max)
            }
        }
    }

    /// Gives each direction by the number of its ray.
    #[inline(always)]
    pub(crate) fn for_each_dir(&self, mut give: impl FnMut(usize, [f32; 3])) {
        match self {
            Self::Arrays(rays) => {
                for index in 0..rays.len() {
                    give(index, [rays.dir_x[index], rays.dir_y[index], rays.dir_z[index]]);
                }
            }
            Self::Rows(rays) => {
                for index in 0..rays.len {
                    give(index, rays.dirs.get(index));
                }
            }
        }
    }

    /// Gives each ray by its number and its eight fields in the order of [`Rays`].
    #[inline(always)]
    pub(crate) fn for_each(&self, mut give: impl FnMut(usize, [f32; 8])) {
        match self {
            Self::Arrays(rays) => {
                let fields = rays.arrays();
                (0..rays.len()).for_each(|index| give(index, each(|field| fields[field][index])));
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

/// What rays may have in common: all but their directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    origin: [f32; 3],
    t_min: f32,
    t_max: f32,
}

impl Start {
    /// Rays that have all this in common.
    pub(crate) fn with<'a>(&self, dirs: &'a [[f32; 3]]) -> RayRows<'a> {
        RayRows {
            len: dirs.len(),
            origins: Rows::Same(self.origin),
            dirs: Rows::F32(dirs),
            t_min: Ends::Same(self.t_min),
            t_max: Ends::Same(self.t_max),
        }
    }
}

fn same(value: f32, other: f32) -> bool {
    value.to_bits() == other.to_bits()
}

/// True if all values are such; looks at some more after the first that is not, for the compiler to take
/// registers.
fn all_are<T>(values: &[T], is: impl Fn(&T) -> bool) -> bool {
    values.chunks(4 * BLOCK).all(|some| some.iter().fold(true, |all, value| all & is(value)))
}
