//! An array that is filled.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};
use memmap2::MmapMut;

use super::{LEAST_BYTES, Line, mapped};

/// An array of a fixed length on a boundary of 64 bytes, on huge pages if it is large and there are any.
pub struct Fresh<T> {
    pub(super) memory: Memory,
    len: usize,
    holds: PhantomData<T>,
}

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
    /// So many values, all bits zero.
    pub fn new(len: usize) -> Self {
        let bytes = len * size_of::<T>();
        let map = if bytes < LEAST_BYTES { None } else { mapped(bytes) };
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
