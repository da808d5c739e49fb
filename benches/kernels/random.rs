//! Random numbers by seed (SplitMix64: Steele, Lea, Flood 2014).

use octray::glam::Vec3;

pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn range(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        low + (high - low) * ((bits >> 40) as f32 / (1 << 24) as f32)
    }

    fn within(&mut self, side: f32) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| self.range(-side, side)))
    }

    /// A place among the rays.
    pub(crate) fn place(&mut self) -> Vec3 {
        self.within(1.0)
    }

    /// An edge from there.
    pub(crate) fn edge(&mut self) -> Vec3 {
        self.within(0.9)
    }
}
