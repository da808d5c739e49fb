//! A growing array that starts at a line of the cache: one field of rays or hits, one entry a ray.
//!
//! Registers of sixteen entries are loaded and stored in turn. In an array that starts in the middle of a
//! line, as a vector of the standard library does, each of them lies in two. Through columns camera rays
//! are 1.03 to 1.1 times as fast as through vectors.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};

use crate::pages::Line;

/// An array on a boundary of 64 bytes. It derefs to a slice; all else is as with a [`Vec`].
#[derive(Clone)]
pub struct Column<T> {
    /// As many as hold the values; what is beyond them may be anything.
    lines: Vec<Line>,
    len: usize,
    holds: PhantomData<T>,
}

impl<T: Pod> Column<T> {
    /// How many values fill a line.
    const A_LINE: usize = {
        assert!(size_of::<Line>().is_multiple_of(size_of::<T>()), "values fill lines");
        size_of::<Line>() / size_of::<T>()
    };

    /// No values, with room for `capacity`.
    pub fn with_capacity(capacity: usize) -> Self {
        let lines = Vec::with_capacity(capacity.div_ceil(Self::A_LINE));
        Self { lines, ..Self::default() }
    }

    /// Makes room for `additional` more values.
    pub fn reserve(&mut self, additional: usize) {
        let lines = (self.len + additional).div_ceil(Self::A_LINE);
        self.lines.reserve(lines.saturating_sub(self.lines.len()));
    }

    /// Appends a value.
    #[inline]
    pub fn push(&mut self, value: T) {
        let place = self.len;
        self.grow_to(place + 1);
        self[place] = value;
    }

    /// Appends values.
    #[inline]
    pub fn extend_from_slice(&mut self, values: &[T]) {
        let start = self.len;
        self.grow_to(start + values.len());
        self[start..].copy_from_slice(values);
    }

    /// Makes the length `len`; new entries are `value`, old ones stay.
    #[inline]
    pub fn resize(&mut self, len: usize, value: T) {
        let old = self.len.min(len);
        self.grow_to(len);
        self[old..].fill(value);
    }

    /// Removes the values from `len` on, and keeps the memory.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
        self.lines.truncate(self.len.div_ceil(Self::A_LINE));
    }

    /// Removes all values, and keeps the memory.
    pub fn clear(&mut self) {
        self.truncate(0);
    }

    /// Makes the length `len`, with anything in new entries.
    #[inline(always)]
    fn grow_to(&mut self, len: usize) {
        let lines = len.div_ceil(Self::A_LINE);
        if lines != self.lines.len() {
            self.lines.resize(lines, Line::zeroed());
        }
        self.len = len;
    }
}

impl<T> Default for Column<T> {
    /// No values.
    fn default() -> Self {
        Self { lines: Vec::new(), len: 0, holds: PhantomData }
    }
}

impl<T: Pod> Deref for Column<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &bytemuck::cast_slice(&self.lines)[..self.len]
    }
}

impl<T: Pod> DerefMut for Column<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..self.len]
    }
}

impl<T: Pod> Extend<T> for Column<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, values: I) {
        let values = values.into_iter();
        self.reserve(values.size_hint().0);
        values.for_each(|value| self.push(value));
    }
}

impl<T: Pod> FromIterator<T> for Column<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        let mut column = Self::default();
        column.extend(values);
        column
    }
}

impl<T: Pod> From<&[T]> for Column<T> {
    fn from(values: &[T]) -> Self {
        let mut column = Self::default();
        column.extend_from_slice(values);
        column
    }
}

impl<T: Pod + PartialEq> PartialEq for Column<T> {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

impl<T: Pod + fmt::Debug> fmt::Debug for Column<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_does_as_a_vector_does() {
        let (mut column, mut vector) = (Column::<u32>::default(), Vec::new());
        for step in 0..200_u32 {
            match step % 7 {
                0 => (column.extend_from_slice(&[step; 13]), vector.extend_from_slice(&[step; 13])),
                1 => (column.truncate(step as usize / 2), vector.truncate(step as usize / 2)),
                2 => (column.resize(step as usize, step), vector.resize(step as usize, step)),
                3 => (column.extend(0..step % 40), vector.extend(0..step % 40)),
                _ => (column.push(step), vector.push(step)),
            };
            assert_eq!(column[..], vector[..], "step {step}");
            assert!(column.as_ptr().addr().is_multiple_of(64), "step {step}");
            assert_eq!(column, vector.iter().copied().collect(), "step {step}");
            assert_eq!(column, Column::from(&vector[..]), "step {step}");
        }
        column.clear();
        assert!(column.is_empty() && column != Column::from(&[1][..]));
    }
}
