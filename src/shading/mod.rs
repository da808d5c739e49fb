//! What a point looks like under light: the Phong formula, and where its samples lie.
//!
//! Plain functions of values; nothing here traces a ray. The scalar reference of [`crate::render`]
//! shades by [`phong`], its tiles by the same formula for sixteen points at once. Both take their
//! samples from [`sampling`].

mod orders;
pub mod phong;
pub(crate) mod phong_lanes;
pub mod sampling;
