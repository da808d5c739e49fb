//! Materials: the coefficients of the Phong model, and the mirror's share.

use glam::Vec3;

/// How a surface answers light. Colours are linear RGB, 0 and above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// `Ka`: the share of ambient light that is sent back.
    pub ambient: Vec3,
    /// `Kd`: the share of diffuse light that is sent back; also the colour in flat shading.
    pub diffuse: Vec3,
    /// `Ks`: the share of specular light that is sent back.
    pub specular: Vec3,
    /// The exponent `n` of the specular term, above zero: the higher, the smaller the highlight.
    pub shininess: f32,
    /// The mirror's share, 0 (none) to 1 (nothing but the reflection).
    pub mirror: f32,
}

impl Material {
    /// A matt surface of this colour, a tenth of it ambient.
    pub fn matt(color: Vec3) -> Self {
        Self { ambient: color, diffuse: color, specular: Vec3::ZERO, shininess: 1.0, mirror: 0.0 }
    }

    /// What is out of range, if anything is.
    pub fn validate(&self) -> Result<(), String> {
        for (name, color) in
            [("ambient", self.ambient), ("diffuse", self.diffuse), ("specular", self.specular)]
        {
            if !(color.is_finite() && color.min_element() >= 0.0) {
                return Err(format!(
                    "`{name}` is {color}: its parts must be finite and at least 0"
                ));
            }
        }
        if !(self.shininess.is_finite() && self.shininess > 0.0) {
            return Err(format!(
                "`shininess` is {}: it must be finite and above 0",
                self.shininess
            ));
        }
        if !(0.0..=1.0).contains(&self.mirror) {
            return Err(format!("`mirror` is {}: it must be from 0 to 1", self.mirror));
        }
        Ok(())
    }
}

impl Default for Material {
    fn default() -> Self {
        Self::matt(Vec3::splat(0.8))
    }
}
