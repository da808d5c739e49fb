//! Where the camera of a stage goes for pictures that nobody chose a threshold by.

use std::fmt;
use std::str::FromStr;

use glam::Vec3;
use thiserror::Error;

use super::Stage;
use crate::scene::Camera;

/// How a stage is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Look {
    /// By the stage's own camera.
    #[default]
    Framed,
    /// Through a lens of 2.5 times the length: six times as many pixels a triangle.
    Near,
    /// From five times as far: twenty-five times as many triangles a pixel.
    Far,
    /// From the middle of what the stage's camera looks at, a little upwards, 90 degrees high.
    Inside,
    /// From as far as the stage's camera, three degrees above the horizon of what it looks at.
    Grazing,
}

impl Look {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Framed, Self::Near, Self::Far, Self::Inside, Self::Grazing];

    /// The same stage, looked at like this.
    pub fn of(self, stage: &Stage) -> Stage {
        let Camera { eye, target, up, vertical_fov } = stage.camera;
        let away = eye - target;
        let level = (away - up * (away.dot(up) / up.length_squared())).normalize_or(Vec3::Z);
        let camera = match self {
            Self::Framed => stage.camera,
            Self::Near => {
                let half = (0.5 * vertical_fov).to_radians().tan() / 2.5;
                Camera { vertical_fov: 2.0 * half.atan().to_degrees(), ..stage.camera }
            }
            Self::Far => Camera { eye: target + 5.0 * away, ..stage.camera },
            Self::Inside => Camera {
                eye: target,
                target: target + level + 0.1 * up.normalize_or_zero(),
                vertical_fov: 90.0,
                up,
            },
            Self::Grazing => {
                let (sine, cosine) = 3.0_f32.to_radians().sin_cos();
                let dir = cosine * level + sine * up.normalize_or_zero();
                Camera { eye: target + dir * away.length(), ..stage.camera }
            }
        };
        Stage { camera, ..*stage }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Framed => "framed",
            Self::Near => "near",
            Self::Far => "far",
            Self::Inside => "inside",
            Self::Grazing => "grazing",
        }
    }
}

impl fmt::Display for Look {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.pad(self.name())
    }
}

/// A name that no look has.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("no look is called `{0}`: there are framed, near, far, inside and grazing")]
pub struct UnknownLook(String);

impl FromStr for Look {
    type Err = UnknownLook;

    fn from_str(name: &str) -> Result<Self, UnknownLook> {
        let named = Self::ALL.into_iter().find(|look| look.name() == name);
        named.ok_or_else(|| UnknownLook(name.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Aabb;

    #[test]
    fn looks_are_where_they_say() {
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::new(4.0, 1.0, 3.0) };
        let stage = Stage::framing(&bounds);
        let (own, center) = (stage.camera, bounds.center());
        for look in Look::ALL {
            assert_eq!(look.to_string().parse(), Ok(look));
            let of = look.of(&stage);
            assert_eq!(Stage { camera: own, ..of }, stage);
            let camera = of.camera;
            let view = camera.view(1.0).expect("a camera that can take a picture");
            let away = camera.eye.distance(center) / own.eye.distance(center);
            let half = |of: &Camera| (0.5 * of.vertical_fov).to_radians().tan();
            let lens = half(&own) / half(&camera);
            let (far, long) = match look {
                Look::Framed | Look::Grazing => (1.0, 1.0),
                Look::Near => (1.0, 2.5),
                Look::Far => (5.0, 1.0),
                Look::Inside => (0.0, half(&own)),
            };
            assert!((away - far).abs() < 1e-4 && (lens - long).abs() < 1e-4, "{look}");
            let rise = -view.dir(glam::Vec2::splat(0.5)).normalize().y;
            assert_eq!((rise.asin().to_degrees() - 3.0).abs() < 0.01, look == Look::Grazing);
        }
        assert!("sideways".parse::<Look>().is_err());
    }
}
