//! Large arrays on huge pages, where the system gives them.
//!
//! A page of 4 KiB is one entry of the processor's address tables, and its first use is a call into the
//! system. Arrays of many megabytes that are used in no order spend much of the time on both.

use std::ops::{Deref, DerefMut};

use bytemuck::Pod;
use memmap2::MmapMut;

/// Smaller arrays would hardly fill one huge page.
const LEAST_BYTES: usize = 4 << 20;

/// An array of a fixed length that starts as zeros, on a boundary of 64 bytes at least if it is large.
#[derive(Debug)]
pub struct Pages<T>(Memory<T>);

#[derive(Debug)]
enum Memory<T> {
    Mapped(MmapMut),
    Owned(Vec<T>),
}

impl<T: Pod> Pages<T> {
    /// So many zeros.
    pub fn zeroed(len: usize) -> Self {
        let bytes = len * size_of::<T>();
        if bytes >= LEAST_BYTES
            && let Ok(map) = MmapMut::map_anon(bytes)
        {
            // A system without huge pages says so, and gives others.
            #[cfg(target_os = "linux")]
            let _ = map.advise(memmap2::Advice::HugePage);
            return Self(Memory::Mapped(map));
        }
        Self(Memory::Owned(vec![T::zeroed(); len]))
    }
}

impl<T: Pod> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        match &self.0 {
            Memory::Mapped(map) => bytemuck::cast_slice(map),
            Memory::Owned(values) => values,
        }
    }
}

impl<T: Pod> DerefMut for Pages<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Memory::Mapped(map) => bytemuck::cast_slice_mut(map),
            Memory::Owned(values) => values,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_of_all_sizes_start_as_zeros_and_keep_what_is_written() {
        for len in [0, 1, 1000, LEAST_BYTES / 4 - 1, LEAST_BYTES / 4, LEAST_BYTES] {
            let mut pages = Pages::<u32>::zeroed(len);
            assert_eq!(pages.len(), len);
            assert!(pages.iter().all(|&value| value == 0));
            pages.iter_mut().zip(1..).for_each(|(value, number)| *value = number);
            assert!(pages.iter().zip(1..).all(|(&value, number)| value == number));
        }
    }
}
