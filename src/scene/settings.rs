//! How a picture of a scene is made: what a scene file's `[render]` table holds.

use glam::Vec3;
use thiserror::Error;

/// The largest width and height of a picture in pixels.
pub const MAX_SIDE: u32 = 65_536;

/// The most pixels of a picture: 3 GiB as linear RGB.
pub const MAX_PIXELS: u64 = 1 << 28;

/// The most camera rays a pixel, and the most shadow rays a point and light.
pub const MAX_SAMPLES: u32 = 65_536;

/// The most mirror bounces of a ray.
pub const MAX_BOUNCES: u32 = 1_024;

/// A setting out of its range.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{0}")]
pub struct SettingsError(String);

/// Which formula gives a point its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// Ambient, diffuse and specular terms with shadows and mirrors.
    #[default]
    Phong,
    /// The diffuse colour of what is hit, without light: for looking at plain intersections.
    Flat,
}

/// Size, sampling and background of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels from left to right.
    pub width: u32,
    /// Pixels from top to bottom.
    pub height: u32,
    /// Camera rays a pixel, at least 1.
    pub spp: u32,
    /// Shadow rays towards each area light from each point, at least 1.
    pub shadow_samples: u32,
    /// How often a ray is mirrored at most.
    pub max_bounces: u32,
    /// What the sample positions derive from, with the pixel.
    pub seed: u64,
    /// The colour of rays that hit nothing, linear RGB.
    pub background: Vec3,
    /// Phong or flat.
    pub shading: Shading,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 800,
            height: 600,
            spp: 1,
            shadow_samples: 16,
            max_bounces: 4,
            seed: 0,
            background: Vec3::ZERO,
            shading: Shading::Phong,
        }
    }
}

impl Settings {
    /// # Errors
    /// [`SettingsError`] names the setting and its range: sides from 1 to [`MAX_SIDE`] with at most
    /// [`MAX_PIXELS`] together, samples from 1 to [`MAX_SAMPLES`], at most [`MAX_BOUNCES`], a
    /// background that is finite and not negative.
    pub fn validate(&self) -> Result<(), SettingsError> {
        for (key, value, low, high) in [
            ("width", self.width, 1, MAX_SIDE),
            ("height", self.height, 1, MAX_SIDE),
            ("spp", self.spp, 1, MAX_SAMPLES),
            ("shadow_samples", self.shadow_samples, 1, MAX_SAMPLES),
            ("max_bounces", self.max_bounces, 0, MAX_BOUNCES),
        ] {
            if !(low..=high).contains(&value) {
                let why = format!("`{key}` is {value}: it must be from {low} to {high}");
                return Err(SettingsError(why));
            }
        }
        let (width, height) = (self.width, self.height);
        let pixels = u64::from(width) * u64::from(height);
        if pixels > MAX_PIXELS {
            return Err(SettingsError(format!(
                "a picture of {width} x {height} has {pixels} pixels: it must have at most \
                 {MAX_PIXELS}"
            )));
        }
        if !(self.background.is_finite() && self.background.min_element() >= 0.0) {
            return Err(SettingsError(format!(
                "`background` is {}: its parts must be finite and at least 0",
                self.background
            )));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_have_ranges() {
        let default = Settings::default();
        assert_eq!(default.validate(), Ok(()));
        let refused = |settings: Settings| settings.validate().unwrap_err().to_string();
        assert_eq!(
            refused(Settings { width: 0, ..default }),
            "`width` is 0: it must be from 1 to 65536"
        );
        assert!(refused(Settings { height: 65_537, ..default }).contains("`height`"));
        assert!(refused(Settings { width: 65_536, height: 4_097, ..default }).contains("pixels"));
        assert_eq!(Settings { width: 65_536, height: 4_096, ..default }.validate(), Ok(()));
        assert!(refused(Settings { spp: 0, ..default }).contains("`spp`"));
        assert!(refused(Settings { shadow_samples: 0, ..default }).contains("`shadow_samples`"));
        assert!(refused(Settings { max_bounces: 1_025, ..default }).contains("`max_bounces`"));
        let background = Vec3::new(0.0, f32::NAN, 0.0);
        assert!(refused(Settings { background, ..default }).contains("`background`"));
    }
}
