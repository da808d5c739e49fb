//! An array that is filled.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};
use memmap2::MmapMut;

use super::{LEAST_BYTES, Line, ask_for_huge, mapped};

/// An array of a fixed length on a boundary of 64 bytes, on huge pages if it is large and there are any.
pub struct Fresh<T> {
    pub(super) memory: Memory,
    len: usize,
    holds: PhantomData<T>,
}

/// For how long an array will be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Term {
    /// Nobody knows: an array above 64 MB is filled on small pages. As soon as it is frozen, the system
    /// may put it on huge ones at its leisure.
    Open,
    /// For long: worth all that huge pages cost.
    Long,
}

/// Larger arrays get huge pages at once only for long: where a virtual machine has given free memory
/// back to its host, a huge page costs 5 ms, six times what as many small ones cost. A tree over ten
/// million triangles was built in twice the time.
const LARGEST_AT_ONCE: usize = 64 << 20;

/// Where the values are, and room after them.
pub(super) enum Memory {
    Mapped(MmapMut),
    Lines(Vec<Line>),
}

impl Memory {
    /// None.
    pub(super) fn none() -> Self {
        Self::Lines(Vec::new())
    }
}

impl<T: Pod> Fresh<T> {
    /// So many values, all bits zero, to be used for that term.
    pub fn new(len: usize, term: Term) -> Self {
        let bytes = len * size_of::<T>();
        let map = if bytes < LEAST_BYTES { None } else { mapped(bytes) };
        if let Some(map) = &map
            && (term == Term::Long || bytes <= LARGEST_AT_ONCE)
        {
            ask_for_huge(map, bytes);
        }
        Self::on(map, len)
    }

    /// So many values in this memory, whatever they are; all bits zero without.
    pub(super) fn on(map: Option<MmapMut>, len: usize) -> Self {
        const { assert!(align_of::<T>() <= align_of::<Line>()) };
        let lines = (len * size_of::<T>()).div_ceil(size_of::<Line>());
        let memory = map.map_or_else(|| Memory::Lines(vec![Line::zeroed(); lines]), Memory::Mapped);
        Self { memory, len, holds: PhantomData }
    }

    /// Forgets all values from this one on.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }
}

impl<T: Pod> Deref for Fresh<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        let bytes = match &self.memory {
            Memory::Mapped(map) => map,
            Memory::Lines(lines) => bytemuck::cast_slice(lines),
        };
        bytemuck::cast_slice(&bytes[..self.len * size_of::<T>()])
    }
}

impl<T: Pod> DerefMut for Fresh<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        let bytes = match &mut self.memory {
            Memory::Mapped(map) => map,
            Memory::Lines(lines) => bytemuck::cast_slice_mut(lines),
        };
        bytemuck::cast_slice_mut(&mut bytes[..self.len * size_of::<T>()])
    }
}

impl<T: Pod + fmt::Debug> fmt::Debug for Fresh<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_list().entries(self.iter()).finish()
    }
}
