//! Affine transforms of meshes.

use glam::{DMat3, DQuat, DVec3};

use crate::geometry::Mesh;

/// A linear map and a shift, in doubles: `x -> linear x + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    linear: DMat3,
    shift: DVec3,
}

impl Transform {
    /// `None` for a map that squeezes space flat, or that is not finite.
    pub(super) fn new(linear: DMat3, shift: DVec3) -> Option<Self> {
        // Against the lengths of its columns: a small scale alone squeezes nothing flat.
        let lengths = linear.x_axis.length() * linear.y_axis.length() * linear.z_axis.length();
        let volume = linear.determinant().abs();
        let regular = volume > 1e-12 * lengths && volume.is_finite() && shift.is_finite();
        regular.then_some(Self { linear, shift })
    }

    /// Moves positions, and normals by the inverse transpose. A mirroring map swaps two corners of
    /// each triangle, so that the outer side stays outside.
    pub(super) fn apply(&self, mesh: &mut Mesh) {
        for position in &mut mesh.positions {
            *position = (self.linear * position.as_dvec3() + self.shift).as_vec3();
        }
        let to_normals = self.linear.inverse().transpose();
        for normal in &mut mesh.normals {
            let moved = (to_normals * normal.as_dvec3()).normalize_or_zero();
            *normal = moved.as_vec3();
        }
        if self.linear.determinant() < 0.0 {
            for triangle in &mut mesh.indices {
                triangle.swap(1, 2);
            }
        }
    }
}

/// About x, then y, then z, in degrees.
pub(super) fn rotation_by_angles(degrees: DVec3) -> DMat3 {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x)
}

/// About an axis of any length; `None` if it has none.
pub(super) fn rotation_by_axis(axis: DVec3, degrees: f64) -> Option<DMat3> {
    let axis = axis.try_normalize()?;
    Some(DMat3::from_quat(DQuat::from_axis_angle(axis, degrees.to_radians())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;

    fn scaled(scale: DVec3) -> Option<Transform> {
        Transform::new(DMat3::from_diagonal(scale), DVec3::ZERO)
    }

    #[test]
    fn flat_maps_are_refused() {
        assert!(scaled(DVec3::splat(1e-30)).is_some());
        assert!(scaled(DVec3::new(1e-9, 1.0, 1e9)).is_some());
        assert!(scaled(DVec3::new(1.0, 0.0, 1.0)).is_none());
        assert!(scaled(DVec3::splat(f64::NAN)).is_none());
        assert!(scaled(DVec3::splat(f64::INFINITY)).is_none());
        let lines = DMat3::from_cols_array(&[1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 0.0, 0.0, 1.0]);
        assert!(Transform::new(lines, DVec3::ZERO).is_none());
        assert!(Transform::new(DMat3::IDENTITY, DVec3::NAN).is_none());
    }

    #[test]
    fn rotations_turn_counterclockwise() {
        let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-12, "{a} is not {b}");
        near(rotation_by_angles(DVec3::Z * 90.0) * DVec3::X, DVec3::Y);
        near(rotation_by_axis(DVec3::Y * 3.0, 90.0).unwrap() * DVec3::Z, DVec3::X);
        // x first: y goes to z, and then, about y, to x.
        near(rotation_by_angles(DVec3::new(90.0, 90.0, 0.0)) * DVec3::Y, DVec3::X);
        assert!(rotation_by_axis(DVec3::ZERO, 90.0).is_none());
    }

    #[test]
    fn normals_stay_across_and_outside() {
        for scale in [DVec3::new(1.0, 3.0, 0.5), DVec3::new(-1.0, 3.0, 1.0)] {
            let mut mesh = shapes::icosphere(4);
            scaled(scale).unwrap().apply(&mut mesh);
            for (i, triangle) in mesh.indices.iter().enumerate() {
                let [a, b, c] = mesh.triangle(i);
                let across = (b - a).cross(c - a).normalize();
                assert!(across.dot(a) > 0.0, "the sphere is inside out");
                for &vertex in triangle {
                    let normal = mesh.normals[vertex as usize];
                    assert!((normal.length() - 1.0).abs() < 1e-5);
                    assert!(normal.dot(across) > 0.9, "{normal} is not across the surface");
                }
            }
        }
    }
}
