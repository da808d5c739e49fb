//! Quads in SoA arrays: a corner and two edges, so any parallelogram.

use glam::{DVec3, Vec3};

use crate::error::{BuildError, ShapeError};

/// Any number of parallelograms. All arrays have one length; entry `i` of each is quad `i`, with
/// the corners `corner`, `corner + edge_u`, `corner + edge_u + edge_v` and `corner + edge_v`.
#[derive(Clone, Debug, Default)]
pub struct Quads {
    /// The corner where `u = v = 0`.
    pub corner_x: Vec<f32>,
    /// See [`Quads::corner_x`].
    pub corner_y: Vec<f32>,
    /// See [`Quads::corner_x`].
    pub corner_z: Vec<f32>,
    /// The edge along `u`.
    pub edge_u_x: Vec<f32>,
    /// See [`Quads::edge_u_x`].
    pub edge_u_y: Vec<f32>,
    /// See [`Quads::edge_u_x`].
    pub edge_u_z: Vec<f32>,
    /// The edge along `v`.
    pub edge_v_x: Vec<f32>,
    /// See [`Quads::edge_v_x`].
    pub edge_v_y: Vec<f32>,
    /// See [`Quads::edge_v_x`].
    pub edge_v_z: Vec<f32>,
}

impl Quads {
    /// One quad.
    pub fn one(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> Self {
        let mut quads = Self::default();
        quads.push(corner, edge_u, edge_v);
        quads
    }

    /// Appends a quad.
    pub fn push(&mut self, corner: Vec3, edge_u: Vec3, edge_v: Vec3) {
        self.corner_x.push(corner.x);
        self.corner_y.push(corner.y);
        self.corner_z.push(corner.z);
        self.edge_u_x.push(edge_u.x);
        self.edge_u_y.push(edge_u.y);
        self.edge_u_z.push(edge_u.z);
        self.edge_v_x.push(edge_v.x);
        self.edge_v_y.push(edge_v.y);
        self.edge_v_z.push(edge_v.z);
    }

    /// How many quads there are.
    pub fn len(&self) -> usize {
        self.corner_x.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Corner and edges of quad `index`.
    pub fn get(&self, index: usize) -> (Vec3, Vec3, Vec3) {
        (
            Vec3::new(self.corner_x[index], self.corner_y[index], self.corner_z[index]),
            Vec3::new(self.edge_u_x[index], self.edge_u_y[index], self.edge_u_z[index]),
            Vec3::new(self.edge_v_x[index], self.edge_v_y[index], self.edge_v_z[index]),
        )
    }

    /// The four corners of quad `index` in order around it. They are what rays are tested against:
    /// each is the exact sum rounded once, so quads whose corners agree leave no gap.
    pub fn corners(&self, index: usize) -> [Vec3; 4] {
        let (corner, edge_u, edge_v) = self.get(index);
        let (corner, edge_u, edge_v) = (corner.as_dvec3(), edge_u.as_dvec3(), edge_v.as_dvec3());
        [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v].map(|p| p.as_vec3())
    }

    /// # Errors
    /// [`BuildError`] for arrays of different lengths, a corner that is not finite, or parallel
    /// edges.
    pub fn validate(&self, geom_id: u32) -> Result<(), BuildError> {
        for (name, array) in [
            ("corner_y", &self.corner_y),
            ("corner_z", &self.corner_z),
            ("edge_u_x", &self.edge_u_x),
            ("edge_u_y", &self.edge_u_y),
            ("edge_u_z", &self.edge_u_z),
            ("edge_v_x", &self.edge_v_x),
            ("edge_v_y", &self.edge_v_y),
            ("edge_v_z", &self.edge_v_z),
        ] {
            ShapeError::check(name, array.len(), "corner_x", self.len())?;
        }
        for index in 0..self.len() {
            let prim_id = index as u32;
            let error = |why| Err(BuildError::Quad { geom_id, prim_id, why });
            if !self.corners(index).iter().all(|corner| corner.is_finite()) {
                return error("has a corner that is not finite");
            }
            let (_, edge_u, edge_v) = self.get(index);
            if edge_u.as_dvec3().cross(edge_v.as_dvec3()) == DVec3::ZERO {
                return error("has no area");
            }
        }
        Ok(())
    }
}
