//! A pinhole camera.

use glam::{Vec2, Vec3};
use thiserror::Error;

use crate::simd::{F32x16, each};

/// A camera that no picture can be taken with.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{message}")]
pub struct CameraError {
    key: &'static str,
    message: String,
}

impl CameraError {
    /// The field of [`Camera`] that is wrong.
    pub fn key(&self) -> &'static str {
        self.key
    }
}

/// A pinhole camera: where it stands and what a picture of it spans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where the camera is.
    pub eye: Vec3,
    /// The point in the middle of the picture.
    pub target: Vec3,
    /// A direction that is up in the picture; not parallel to the view.
    pub up: Vec3,
    /// The angle from the lower to the upper edge of the picture, in degrees, 0 to 180 exclusive.
    pub vertical_fov: f32,
}

/// A camera made ready for pictures of one aspect ratio.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Where all rays start.
    pub eye: Vec3,
    forward: Vec3,
    right: Vec3,
    up: Vec3,
}

impl Camera {
    /// A camera that sees the whole sphere around `bounds` from the direction of `(0.35, 0.35, 1)`.
    pub fn framing(bounds: &crate::geometry::Aabb) -> Self {
        let center = bounds.center();
        // 1.1 diagonals away the bounding sphere spans 54 degrees; meshes fill less of it.
        let distance = 1.1 * bounds.diagonal().max(f32::MIN_POSITIVE);
        let eye = center + Vec3::new(0.35, 0.35, 1.0).normalize() * distance;
        Self { eye, target: center, up: Vec3::Y, vertical_fov: 40.0 }
    }

    /// The view for a picture `aspect` times as wide as high.
    ///
    /// # Errors
    /// [`CameraError`] for numbers that are not finite, an eye on the target, an up direction along
    /// the view, or an angle that is not between 0 and 180 degrees.
    pub fn view(&self, aspect: f32) -> Result<View, CameraError> {
        let error = |key, message: String| Err(CameraError { key, message });
        for (name, point) in [("eye", self.eye), ("target", self.target), ("up", self.up)] {
            if !point.is_finite() {
                return error(
                    name,
                    format!("camera `{name}` is {point}: its parts must be finite"),
                );
            }
        }
        if !(self.vertical_fov > 0.0 && self.vertical_fov < 180.0) {
            return error(
                "vertical_fov",
                format!(
                    "camera `vertical_fov` is {}: it must be above 0 and below 180 degrees",
                    self.vertical_fov
                ),
            );
        }
        // In doubles, so that a camera at 1e+30 or a difference of 1e-30 has a direction.
        let forward = (self.target.as_dvec3() - self.eye.as_dvec3()).normalize_or_zero();
        if forward == glam::DVec3::ZERO {
            return error(
                "target",
                "camera `eye` and `target` are one point: move them apart".into(),
            );
        }
        let right = forward.cross(self.up.as_dvec3().normalize_or_zero());
        if right.length() < 1e-6 {
            return error(
                "up",
                "camera `up` is zero or along the view: choose one across it, such as [0, 1, 0]"
                    .into(),
            );
        }
        let right = right.normalize();
        let up = right.cross(forward);
        let half_height = (f64::from(self.vertical_fov).to_radians() * 0.5).tan();
        Ok(View {
            eye: self.eye,
            forward: forward.as_vec3(),
            right: (right * half_height * f64::from(aspect)).as_vec3(),
            up: (up * half_height).as_vec3(),
        })
    }
}

impl View {
    /// The direction, not of unit length, through a point of the picture: (0, 0) is the upper left
    /// corner and (1, 1) the lower right one.
    pub fn dir(&self, at: Vec2) -> Vec3 {
        self.forward + self.right * (2.0 * at.x - 1.0) + self.up * (1.0 - 2.0 * at.y)
    }

    /// [`View::dir`] of sixteen points, with the same bits.
    #[inline(always)]
    pub(crate) fn dirs(&self, across: F32x16, down: F32x16) -> [F32x16; 3] {
        let (one, two) = (F32x16::splat(1.0), F32x16::splat(2.0));
        let (across, down) = (two * across - one, one - two * down);
        each(|axis| {
            let part = |of: Vec3| F32x16::splat(of[axis]);
            part(self.forward) + part(self.right) * across + part(self.up) * down
        })
    }
}
