//! An array that is only read.

use std::fmt;
use std::ops::Deref;

use bytemuck::Pod;
use memmap2::MmapMut;
use yoke::Yoke;
use yoke::either::EitherCart;

use super::fresh::{Fresh, Memory, Term};
use super::{Line, ask_for_huge};

/// An array on a boundary of 64 bytes that nobody writes to any more, on huge pages if it is large and
/// there are any. It keeps its slice beside its memory, so that looking into it takes no more than
/// with a vector.
pub struct Frozen<T: 'static>(Yoke<&'static [T], EitherCart<MmapMut, Vec<Line>>>);

impl<T: Pod> Fresh<T> {
    /// The same values, never to be changed.
    pub fn freeze(mut self) -> Frozen<T> {
        let bytes = self.len() * size_of::<T>();
        Frozen(match std::mem::replace(&mut self.memory, Memory::none()) {
            Memory::Mapped(map) => {
                ask_for_huge(&map, bytes);
                Yoke::attach_to_cart(map, |map: &[u8]| bytemuck::cast_slice(&map[..bytes]))
                    .wrap_cart_in_either_a()
            }
            Memory::Lines(lines) => Yoke::attach_to_cart(lines, |lines: &[Line]| {
                bytemuck::cast_slice(&bytemuck::cast_slice::<Line, u8>(lines)[..bytes])
            })
            .wrap_cart_in_either_b(),
        })
    }
}

impl<T: Pod> Frozen<T> {
    /// The memory that it takes, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val::<[T]>(self)
    }
}

impl<T> Deref for Frozen<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        self.0.get()
    }
}

impl<T: Pod> Default for Frozen<T> {
    fn default() -> Self {
        Fresh::new(0, Term::Open).freeze()
    }
}

impl<T: Pod> Clone for Frozen<T> {
    fn clone(&self) -> Self {
        let mut copy = Fresh::new(self.len(), Term::Open);
        copy.copy_from_slice(self);
        copy.freeze()
    }
}

impl<T: fmt::Debug> fmt::Debug for Frozen<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::super::LEAST_BYTES;
    use super::*;

    #[test]
    fn arrays_of_all_sizes_keep_what_was_written() {
        const LARGE: usize = LEAST_BYTES / size_of::<[u32; 3]>() + 1;
        for len in [0, 1, 5, 6, 1000, LARGE - 2, LARGE - 1, LARGE, 2 * LARGE] {
            let mut fresh = Fresh::<[u32; 3]>::new(len + 3, Term::Open);
            assert!(fresh.iter().all(|&value| value == [0; 3]));
            fresh.iter_mut().zip(1..).for_each(|(value, number)| *value = [number, 7, !number]);
            fresh.truncate(len);
            let frozen = fresh.freeze();
            let copy = frozen.clone();
            // Where the slice is must not depend on where the array is.
            let moved = Box::new(frozen);
            for array in [&copy, &*moved] {
                assert_eq!((array.len(), array.bytes()), (len, 12 * len));
                assert!(
                    array.iter().zip(1..).all(|(&value, number)| value == [number, 7, !number])
                );
                assert_eq!(array.as_ptr().addr() % 64, 0);
            }
            assert!(len == 0 || copy.as_ptr() != moved.as_ptr());
        }
        assert!(Frozen::<u64>::default().is_empty());
    }
}
