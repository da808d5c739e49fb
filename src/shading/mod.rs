//! What a point looks like under light: the Phong formula, and where its samples lie.
//!
//! Plain functions of values; nothing here traces a ray. Both the tiles of [`crate::render`] and
//! its scalar reference call them, so the two differ in how they trace and in nothing else.

pub mod phong;
pub mod sampling;
