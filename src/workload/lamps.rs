//! Lights that are hard for shadows in other ways than a stage's own.

use std::fmt;

use glam::Vec3;

use super::Stage;
use super::model::horizontal_light;
use crate::scene::LightShape;

/// Where light comes from, in place of the stage's own light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lamp {
    /// A square a tenth of the diagonal wide, a hundredth of it above the surface in the middle of the
    /// picture: from there it fills the sky.
    Near,
    /// A horizontal square half of the diagonal wide, where the stage's light is.
    Huge,
    /// A square a quarter of the diagonal wide where the stage's light is, turned so that the surface in
    /// the middle of the picture lies in its plane: it is seen edge-on.
    Grazing,
    /// Sixty-four horizontal squares, each a sixty-fourth of the diagonal wide, spread over a square
    /// half of the diagonal wide where the stage's light is.
    Many,
}

impl Lamp {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Near, Self::Huge, Self::Grazing, Self::Many];

    /// How many lights it has.
    pub fn count(self) -> usize {
        if self == Self::Many { 64 } else { 1 }
    }

    /// The lights; `target` and `normal` are the surface in the middle of the picture.
    pub(super) fn lights(self, stage: &Stage, target: Vec3, normal: Vec3) -> Vec<LightShape> {
        let (middle, diagonal) = (stage.light.at(0.5, 0.5), stage.diagonal);
        let square = |center: Vec3, u: Vec3, v: Vec3| {
            vec![LightShape::Quad { corner: center - (u + v) * 0.5, edge_u: u, edge_v: v }]
        };
        match self {
            Self::Near => {
                let (u, v) = normal.any_orthonormal_pair();
                let width = 0.1 * diagonal;
                square(target + normal * (0.01 * diagonal), u * width, v * width)
            }
            Self::Huge => vec![horizontal_light(middle, 0.5 * diagonal)],
            Self::Grazing => {
                let along = (target - middle).normalize_or(Vec3::NEG_Y);
                let (across, _) = along.any_orthonormal_pair();
                square(middle, along * (0.25 * diagonal), across * (0.25 * diagonal))
            }
            Self::Many => {
                let at = |place: usize| (place as f32 - 3.5) * diagonal / 16.0;
                let light = |place: usize| {
                    let aside = Vec3::new(at(place % 8), 0.0, at(place / 8));
                    horizontal_light(middle + aside, diagonal / 64.0)
                };
                (0..self.count()).map(light).collect()
            }
        }
    }

    /// What it is called before the number of samples, in the names of kinds.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Near => "near",
            Self::Huge => "huge",
            Self::Grazing => "grazing",
            Self::Many => "many",
        }
    }
}

impl fmt::Display for Lamp {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.pad(self.name())
    }
}
