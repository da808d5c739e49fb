//! The order of a node's children: that in which a ray that asks for any hit is done soonest.
//!
//! Of the children that it enters, the one goes first that is likeliest to stop it for what it costs
//! to look. Both are estimated from areas: a line that meets a convex box meets a convex thing in it
//! with the ratio of their surfaces (Goldsmith and Salmon 1987), and a ray that is not stopped by one
//! child goes on to the next.

use super::node::{Child, Node, WIDTH};
use crate::geometry::Aabb;

/// What share of its box's surface a primitive is taken to have: that of a triangle across the box.
/// With the surfaces themselves (flat ones count more then) rays from the bunny and the terrain to 16
/// samples are 0.88 and 0.95 times as fast, others the same.
const FILLED: f32 = 0.25;

/// A leaf with more surface than this many boxes stops every ray.
const OPAQUE: f32 = 32.0;

/// What is expected of a ray that enters a box.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outlook {
    /// How likely it ends there.
    stopped: f32,
    /// How many nodes and leaves it enters until then.
    cost: f32,
}

/// What a slot of a node will hold.
#[derive(Clone, Copy)]
pub(super) struct Slot {
    pub(super) bounds: Aabb,
    pub(super) child: Child,
    pub(super) outlook: Outlook,
}

impl Default for Slot {
    fn default() -> Self {
        Self { bounds: Aabb::EMPTY, child: Child::EMPTY, outlook: Outlook::default() }
    }
}

impl Outlook {
    /// The outlook of a leaf in 32 bits.
    pub(super) fn stopped_bits(self) -> u32 {
        self.stopped.to_bits()
    }

    /// The inverse of [`Outlook::stopped_bits`].
    pub(super) fn of_stopped_bits(bits: u32) -> Self {
        Self { stopped: f32::from_bits(bits), cost: 1.0 }
    }

    /// That of a leaf, whose box is `bounds`. `surface` is half of that of its primitives' boxes.
    pub(super) fn of_leaf(surface: f32, bounds: &Aabb) -> Self {
        // A box without surface, or with more than floats hold, is taken to be full.
        let layers = (FILLED * surface / bounds.half_area()).min(OPAQUE);
        Self { stopped: 1.0 - (-layers).exp(), cost: 1.0 }
    }
}

/// Puts the slots in order and into a node, whose box is `bounds`. What is expected of it.
pub(super) fn arrange(node: &mut Node, slots: &[Slot], bounds: &Aabb) -> Outlook {
    let order = order(slots);
    let area = bounds.half_area();
    let (mut going_on, mut cost) = (1.0, 1.0);
    for (place, &slot) in order[..slots.len()].iter().enumerate() {
        let slot = &slots[slot];
        node.set(place, &slot.bounds, slot.child);
        let entered = (slot.bounds.half_area() / area).min(1.0);
        cost += going_on * entered * slot.outlook.cost;
        going_on *= 1.0 - entered * slot.outlook.stopped;
    }
    Outlook { stopped: 1.0 - going_on, cost }
}

/// The slots by falling worth, equal ones as they stand. A slot's place is the number of those
/// before it: without branches, which would be mispredicted all the time.
fn order(slots: &[Slot]) -> [usize; WIDTH] {
    let mut keys = [0; WIDTH];
    for (place, (key, slot)) in keys.iter_mut().zip(slots).enumerate() {
        // Worths are not negative, so their bits compare as they do.
        let worth = slot.outlook.stopped / slot.outlook.cost;
        *key = u64::from(worth.to_bits()) << 3 | (WIDTH - 1 - place) as u64;
    }
    let mut places = [0_u64; WIDTH];
    for one in keys {
        for (place, other) in places.iter_mut().zip(keys) {
            *place += u64::from(one > other);
        }
    }
    let mut order = [0; WIDTH];
    for (slot, place) in places.into_iter().enumerate().take(slots.len()) {
        order[place as usize % WIDTH] = slot;
    }
    order
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn cube(side: f32) -> Aabb {
        Aabb { min: Vec3::ZERO, max: Vec3::splat(side) }
    }

    /// A cube around so many primitives of the same size.
    fn leaf(side: f32, primitives: usize) -> Outlook {
        Outlook::of_leaf(cube(side).half_area() * primitives as f32, &cube(side))
    }

    /// Children named by number, in the order in which they are put.
    fn arranged(children: &[(f32, Outlook)]) -> (Vec<u32>, Outlook) {
        let mut node = Node::empty();
        let slot = |(index, &(side, outlook)): (u32, &(f32, Outlook))| Slot {
            bounds: cube(side),
            child: Child::Inner(index),
            outlook,
        };
        let slots: Vec<Slot> = (0..).zip(children).map(slot).collect();
        let outlook = arrange(&mut node, &slots, &cube(2.0));
        assert!((slots.len()..WIDTH).all(|slot| node.child(slot) == Child::EMPTY));
        (node.index[..slots.len()].to_vec(), outlook)
    }

    #[test]
    fn what_stops_a_ray_soonest_comes_first() {
        let (full, airy) = (leaf(1.0, 8), leaf(2.0, 1));
        assert!(full.stopped > 0.8 && airy.stopped < 0.3, "{full:?} {airy:?}");
        assert_eq!(arranged(&[(2.0, airy), (1.0, full)]).0, [1, 0], "not the largest");
        let deep = Outlook { cost: 9.0, ..full };
        assert_eq!(
            arranged(&[(1.0, deep), (2.0, airy), (1.0, full)]).0,
            [2, 1, 0],
            "not the likeliest"
        );
        assert_eq!(arranged(&[(1.0, full), (1.0, full)]).0, [0, 1], "equals stay");
    }

    #[test]
    fn a_node_is_what_its_children_are() {
        let half = Outlook { stopped: 0.5, cost: 2.0 };
        // A cube of half the side has a quarter of the surface.
        let (_, outlook) = arranged(&[(1.0, half), (2.0, half)]);
        assert_eq!(outlook.stopped, 1.0 - (1.0 - 0.25 * 0.5) * 0.5);
        assert_eq!(outlook.cost, 1.0 + 0.25 * 2.0 + (1.0 - 0.25 * 0.5) * 2.0);
    }

    #[test]
    fn boxes_without_a_size_have_an_outlook() {
        for side in [0.0, 1e-30, 1e30, f32::MAX] {
            let one = leaf(side, 8);
            assert!((0.0..=1.0).contains(&one.stopped), "{one:?}");
            let (_, outlook) = arranged(&[(side, one), (side, one)]);
            assert!((0.0..=1.0).contains(&outlook.stopped) && outlook.cost >= 1.0, "{outlook:?}");
        }
    }
}
