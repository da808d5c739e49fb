//! Hashes, and the orders that they choose: what sample sets are made of.

/// The golden ratio's odd 64-bit fraction: steps of it visit all 64-bit numbers.
pub(super) const ODD: u64 = 0x9e37_79b9_7f4a_7c15;

/// A bijection of 64-bit numbers in which each input bit moves half of the output bits (the
/// finalizer of SplitMix64: Steele, Lea, Flood 2014).
#[inline]
pub(super) fn mix(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// A step of the golden ratio's odd 32-bit fraction.
pub(super) const SHORT_ODD: u32 = 0x9e37_79b9;

/// A 32-bit mixer whose bits all depend on all others (Wellons, "Prospecting for Hash Functions", 2018):
/// unlike [`mix`] it has a multiplication that registers of integers have too.
#[inline(always)]
pub(super) fn mix_short(value: u32) -> u32 {
    let value = (value ^ (value >> 16)).wrapping_mul(0x7feb_352d);
    let value = (value ^ (value >> 15)).wrapping_mul(0x846c_a68b);
    value ^ (value >> 16)
}

/// Writes 0, 1, 2, .. in an order that `key` fixes (Fisher and Yates).
#[inline(always)]
pub(super) fn shuffle(order: &mut [f32], key: u64) {
    if let Ok(order) = <&mut [f32; 4]>::try_from(&mut *order) {
        *order = four(key);
        return;
    }
    let (mut state, mut random) = (key, 0);
    for last in 0..order.len() {
        // Each choice takes the upper part of the product and leaves the lower one to the next. Four
        // choices of up to 258 take half of the bits.
        if last % 4 == 0 {
            state = state.wrapping_add(ODD);
            random = mix(state);
        }
        let product = u128::from(random) * (last as u128 + 1);
        let other = (product >> 64) as usize;
        random = product as u64;
        order[last] = order[other];
        order[other] = last as f32;
    }
}

/// 0, 1, 2, 3 in an order that `key` fixes.
#[inline(always)]
pub(super) fn four(key: u64) -> [f32; 4] {
    // 24 of 2^32: no order is likelier than another by more than 6e-9.
    let random = mix_short(key as u32 ^ mix_short((key >> 32) as u32));
    ORDERS_OF_FOUR[((u64::from(random) * 24) >> 32) as usize % 24]
}

/// All orders of 0, 1, 2, 3.
const ORDERS_OF_FOUR: [[f32; 4]; 24] = {
    let mut orders = [[0.0; 4]; 24];
    let mut number = 0;
    while number < 24 {
        // The digits of the number in base 4, 3, 2 say where each next value goes: among the places
        // still free.
        let (mut rest, mut taken, mut value) = (number, 0, 0);
        while value < 4 {
            let mut free = rest % (4 - value);
            rest /= 4 - value;
            let mut place = 0;
            while taken >> place & 1 != 0 || free > 0 {
                free -= if taken >> place & 1 == 0 { 1 } else { 0 };
                place += 1;
            }
            taken |= 1 << place;
            orders[number][place] = value as f32;
            value += 1;
        }
        number += 1;
    }
    orders
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_of_four_are_all_there() {
        let mut orders = ORDERS_OF_FOUR.map(|order| order.map(|value| value as u32));
        orders.sort_unstable();
        assert!(orders.windows(2).all(|pair| pair[0] < pair[1]));
        for mut order in orders {
            order.sort_unstable();
            assert_eq!(order, [0, 1, 2, 3]);
        }
    }
}
