//! Polygons to triangles.

use glam::DVec3;

/// Ear cutting takes up to the third power of this: no file can make it take long.
const MOST_CORNERS: usize = 256;

/// Cuts a polygon of at least three corners into triangles, as indices of its corners, wound as
/// the polygon is. A convex one becomes a fan around its first corner; from others, ears are cut.
/// A polygon that crosses itself or lies on a line gives the right number of triangles and no
/// promise which; one of more than [`MOST_CORNERS`] is taken as convex.
pub(crate) fn triangles(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let count = corners.len();
    let fan = (1..count.saturating_sub(1)).map(|i| [0, i, i + 1]);
    if count <= 3 || count > MOST_CORNERS {
        return fan.collect();
    }
    let normal = normal(corners);
    let turn = |a: usize, b: usize, c: usize| {
        (corners[b] - corners[a]).cross(corners[c] - corners[b]).dot(normal)
    };
    let convex = (0..count).all(|i| turn(i, (i + 1) % count, (i + 2) % count) >= 0.0);
    if convex || !normal.is_finite() {
        return fan.collect();
    }
    let mut left: Vec<usize> = (0..count).collect();
    let mut triangles = Vec::with_capacity(count - 2);
    while left.len() > 3 {
        let len = left.len();
        let around = |i: usize| [left[(i + len - 1) % len], left[i], left[(i + 1) % len]];
        let is_ear = |&i: &usize| {
            let [a, b, c] = around(i);
            let holds =
                |p: usize| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
            let others = left.iter().filter(|p| ![a, b, c].contains(p));
            turn(a, b, c) > 0.0 && !others.copied().any(holds)
        };
        // Without an ear (the polygon crosses itself) any corner goes, so that this ends.
        let ear = (0..len).find(is_ear).unwrap_or(1);
        triangles.push(around(ear));
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// A vector across the polygon, as long as twice its area (Newell).
fn normal(corners: &[DVec3]) -> DVec3 {
    let next = corners.iter().cycle().skip(1);
    let origin = corners[0];
    corners.iter().zip(next).map(|(&a, &b)| (a - origin).cross(b - origin)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], [a, b, c]: [usize; 3]) -> f64 {
        (corners[b] - corners[a]).cross(corners[c] - corners[a]).z * 0.5
    }

    fn flat(points: &[(f64, f64)]) -> Vec<DVec3> {
        points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect()
    }

    #[test]
    fn convex_polygons_are_fans() {
        let square = flat(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
        assert_eq!(triangles(&square), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles(&square[..3]), [[0, 1, 2]]);
    }

    #[test]
    fn concave_polygons_keep_their_area() {
        // An arrow whose fan around the first corner would stick out, and a comb.
        let arrow = flat(&[(0.0, 0.0), (2.0, -1.0), (0.5, 0.0), (2.0, 1.0)]);
        let comb = flat(&[
            (0.0, 0.0),
            (5.0, 0.0),
            (5.0, 3.0),
            (4.0, 3.0),
            (4.0, 1.0),
            (3.0, 1.0),
            (3.0, 3.0),
            (2.0, 3.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (0.0, 3.0),
        ]);
        for (polygon, whole) in [(arrow, 0.5), (comb, 11.0)] {
            for shift in 0..polygon.len() {
                let mut turned = polygon.clone();
                turned.rotate_left(shift);
                let parts = triangles(&turned);
                assert_eq!(parts.len(), turned.len() - 2);
                let areas: Vec<f64> = parts.iter().map(|&part| area(&turned, part)).collect();
                assert!(areas.iter().all(|&area| area >= 0.0), "{areas:?}");
                assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn odd_polygons_end() {
        let bow = flat(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.5, 2.0)]);
        assert_eq!(triangles(&bow).len(), 3);
        assert_eq!(triangles(&[DVec3::ZERO; 6]).len(), 4);
        assert_eq!(triangles(&[DVec3::NAN; 5]).len(), 3);
        assert!(triangles(&[DVec3::ZERO; 2]).is_empty());
    }
}
