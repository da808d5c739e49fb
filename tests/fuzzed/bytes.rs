//! Bytes as a source of choices and of floats that are worth trying.

use glam::Vec3;

/// What is left of the bytes. After the last one come zeros.
pub struct Bytes<'a> {
    rest: &'a [u8],
    /// The floats so far, to be repeated: equal coordinates are where ties are.
    seen: Vec<f32>,
}

impl<'a> Bytes<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, seen: vec![0.0] }
    }

    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        match self.rest {
            [first, rest @ ..] => {
                self.rest = rest;
                *first
            }
            [] => 0,
        }
    }

    pub fn u32(&mut self) -> u32 {
        u32::from_le_bytes([0; 4].map(|_| self.byte()))
    }

    /// A float: a small whole number, one from before or beside it, or any bits.
    pub fn float(&mut self) -> f32 {
        let choice = self.byte();
        let value = match choice {
            // From -12 to 12 in halves.
            0..=96 => f32::from(choice) * 0.25 - 12.0,
            97..=160 => self.seen[usize::from(choice) % self.seen.len()],
            161..=200 => {
                let value = self.seen[usize::from(choice) % self.seen.len()];
                if choice.is_multiple_of(2) { value.next_up() } else { value.next_down() }
            }
            // Sizes from 2^-20 to 2^20.
            201..=241 => (f32::from(choice) - 221.0).exp2(),
            _ => f32::from_bits(self.u32()),
        };
        if self.seen.len() < 64 {
            self.seen.push(value);
        }
        value
    }

    pub fn vec(&mut self) -> Vec3 {
        Vec3::new(self.float(), self.float(), self.float())
    }
}
