//! Pixels in eight bits a value, as most formats hold them.

use crate::render::Aov;

/// Makes codes of pixels; [`crate::render::PictureFormat`] says which.
pub(super) struct EightBits {
    aov: Aov,
    /// The distance that is black, and how much nearer white is.
    far: f32,
    range: f32,
    srgb: SrgbCodes,
}

impl EightBits {
    /// For pictures of this kind between these distances.
    pub(super) fn new(aov: Aov, [near, far]: [f32; 2]) -> Self {
        let range = (far - near).max(f32::MIN_POSITIVE);
        Self { aov, far, range, srgb: SrgbCodes::new() }
    }

    /// Writes the codes of as many pixels.
    pub(super) fn write(&self, pixels: &[[f32; 3]], codes: &mut [[u8; 3]]) {
        let (values, bytes) = (pixels.as_flattened(), codes.as_flattened_mut());
        match self.aov {
            Aov::Color => self.srgb.write(values, bytes),
            Aov::Normal => write_each(bytes, values, |n| eighth(n * 0.5 + 0.5)),
            Aov::Depth => {
                write_each(bytes, values, |depth| eighth((self.far - depth) / self.range));
            }
            Aov::Prim => {
                for (code, &pixel) in codes.iter_mut().zip(pixels) {
                    *code = prim_color(pixel).map(eighth);
                }
            }
        }
    }

    /// Writes the codes of as many pixels, which come part by part, each pixel's in one number.
    pub(super) fn pack(&self, values: [&[f32]; 3], codes: &mut [u32]) {
        if self.aov == Aov::Color {
            return self.srgb.pack(values, codes);
        }
        let [r, g, b] = values;
        for (code, ((&r, &g), &b)) in codes.iter_mut().zip(r.iter().zip(g).zip(b)) {
            let mut pixel = [[0; 3]];
            self.write(&[[r, g, b]], &mut pixel);
            *code = packed(pixel[0]);
        }
    }
}

/// The codes of a pixel, the first in the lowest bits.
#[inline(always)]
fn packed([r, g, b]: [u8; 3]) -> u32 {
    u32::from_le_bytes([r, g, b, 0])
}

/// Writes what `of` gives for each value.
fn write_each(bytes: &mut [u8], values: &[f32], of: impl Fn(f32) -> u8) {
    bytes.iter_mut().zip(values).for_each(|(byte, &value)| *byte = of(value));
}

/// A value from 0 to 1 in 8 bits. NaN becomes 0.
fn eighth(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The sRGB curve: from linear to encoded, both 0 to 1.
fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The curve as a table, with the same codes: a power for each value took longer than all else that
/// is done for a pixel's file.
///
/// A step is the upper bits of a float, and holds one code or two. Its entry is the code of its smallest
/// value, shifted, plus so much that the lower bits of a float carry into the code from the second
/// code's smallest value on. So a value takes one look and an addition, and sixteen go side by side.
struct SrgbCodes {
    of_step: [u32; Self::STEPS],
}

impl SrgbCodes {
    /// 2^-13, which is code 0.
    const FIRST: u32 = 0x3900_0000;
    /// 256 steps an octave: in none are there more than two codes.
    const SHIFT: u32 = 15;
    /// A power of two, so that no index needs a check; the step of 1 is 3,328.
    const STEPS: usize = 4096;

    fn new() -> Self {
        let smallest = smallest_of_codes();
        let (mut of_step, mut code) = ([0; Self::STEPS], 0);
        for (step, entry) in (0..).zip(&mut of_step) {
            let first = Self::FIRST + (step << Self::SHIFT);
            while smallest[code + 1] <= first {
                code += 1;
            }
            let second = (smallest[code + 1] - first).min(1 << Self::SHIFT);
            *entry = ((code as u32 + 1) << Self::SHIFT) - second;
        }
        Self { of_step }
    }

    /// Writes the code of each value. A function of its own: only if the compiler is told that none of
    /// the three lie in one another does it look up sixteen values at once, a third of the time.
    #[inline(never)]
    fn write(&self, values: &[f32], bytes: &mut [u8]) {
        for (byte, &value) in bytes.iter_mut().zip(values) {
            *byte = self.of(value);
        }
    }

    /// The same part by part.
    #[inline(never)]
    fn pack(&self, [r, g, b]: [&[f32]; 3], codes: &mut [u32]) {
        for (code, ((&r, &g), &b)) in codes.iter_mut().zip(r.iter().zip(g).zip(b)) {
            *code = packed([self.of(r), self.of(g), self.of(b)]);
        }
    }

    /// The code of a linear value; 0 for NaN.
    #[inline(always)]
    fn of(&self, linear: f32) -> u8 {
        let first = f32::from_bits(Self::FIRST);
        // Asked this way round, a NaN becomes the first.
        let value = if linear > first { linear } else { first };
        let bits = value.min(1.0).to_bits() - Self::FIRST;
        let entry = self.of_step[(bits >> Self::SHIFT) as usize % Self::STEPS];
        let within = bits & ((1 << Self::SHIFT) - 1);
        ((entry + within) >> Self::SHIFT) as u8
    }
}

/// The bits of the smallest value of each code that is at least [`SrgbCodes::FIRST`], and at the end
/// bits that no value reaches. The bits of positive floats are in their order.
fn smallest_of_codes() -> [u32; 257] {
    let mut smallest = [u32::MAX; 257];
    for (code, smallest) in (1..).zip(&mut smallest[1..256]) {
        let (mut below, mut at) = (SrgbCodes::FIRST, 1.0_f32.to_bits());
        while at - below > 1 {
            let middle = below + (at - below) / 2;
            let reaches = eighth(srgb(f32::from_bits(middle))) >= code;
            (below, at) = if reaches { (below, middle) } else { (middle, at) };
        }
        *smallest = at;
    }
    smallest
}

/// A bright colour that differs between neighbouring ids; black for a miss.
pub(super) fn prim_color([geom_id, prim_id, hit]: [f32; 3]) -> [f32; 3] {
    if hit == 0.0 {
        return [0.0; 3];
    }
    let mut bits = (geom_id as u32).wrapping_mul(0x9e37_79b9) ^ (prim_id as u32);
    for _ in 0..2 {
        bits = (bits ^ (bits >> 16)).wrapping_mul(0x7feb_352d);
        bits = (bits ^ (bits >> 15)).wrapping_mul(0x846c_a68b);
    }
    [0, 8, 16].map(|shift| 0.2 + 0.8 * (bits >> shift & 255) as f32 / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_srgb() {
        let pixel = |value| {
            let mut codes = [[0; 3]];
            EightBits::new(Aov::Color, [0.0, 1.0]).write(&[[value; 3]], &mut codes);
            codes[0][0]
        };
        // 0.2140411 is the middle grey 128 of sRGB; 0.0030353 is 10 by the straight part.
        for (linear, encoded) in [
            (0.0, 0),
            (1.0, 255),
            (0.215_86, 128),
            (0.003_035_3, 10),
            (7.0, 255),
            (-1.0, 0),
            (f32::NAN, 0),
            (f32::INFINITY, 255),
        ] {
            assert_eq!(pixel(linear), encoded, "{linear}");
        }
    }

    #[test]
    fn the_table_is_the_curve() {
        let codes = SrgbCodes::new();
        let small = (0..=1_000_000).map(|step| step as f32 * 1.1e-6);
        let tiny = (0..10_000).map(|step| step as f32 * 1e-8);
        let smallest = smallest_of_codes();
        let edges = smallest[1..256].iter().flat_map(|&bits| {
            let at = f32::from_bits(bits);
            [at.next_down(), at, at.next_up()]
        });
        for value in small.chain(tiny).chain(edges) {
            assert_eq!(codes.of(value), eighth(srgb(value)), "{value}");
        }
    }
}
