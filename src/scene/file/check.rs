//! Values out of spans: each check either gives the value as the scene wants it, or one located
//! error that says what is wrong and what would be right.

use std::ops::{Range, RangeInclusive};
use std::path::Path;

use glam::{DVec3, Vec3};
use toml::Spanned;

use super::error::{LoadError, Place, Problem};
use super::values::{Number, OneOrThree, Triple, Whole};

/// The text of a scene file, for errors in it.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) file: &'a Path,
    pub(super) text: &'a str,
}

impl Source<'_> {
    /// An error at a span.
    pub(super) fn fail(&self, span: Range<usize>, problem: Problem) -> LoadError {
        LoadError::new(self.file, Some(Place::of(self.text, span.start)), problem)
    }

    /// A value that is out of its range.
    pub(super) fn wrong<T>(&self, at: &Spanned<T>, message: String) -> LoadError {
        self.fail(at.span(), Problem::Value(message))
    }

    /// A finite point or direction.
    pub(super) fn vector(&self, key: &str, at: &Spanned<Triple>) -> Result<Vec3, LoadError> {
        let value = at.get_ref().0;
        finite(value).ok_or_else(|| {
            let value = show(value);
            self.wrong(at, format!("`{key}` is {value}: its parts must be finite 32-bit floats"))
        })
    }

    /// Linear RGB, finite and not negative.
    pub(super) fn color(&self, key: &str, at: &Spanned<OneOrThree>) -> Result<Vec3, LoadError> {
        let value = at.get_ref().0;
        finite(value).filter(|color| color.min_element() >= 0.0).ok_or_else(|| {
            let value = show(value);
            self.wrong(at, format!("`{key}` is {value}: its parts must be finite and at least 0"))
        })
    }

    /// A finite number above zero.
    pub(super) fn positive(&self, key: &str, at: &Spanned<Number>) -> Result<f32, LoadError> {
        let value = at.get_ref().0;
        let float = value as f32;
        if float.is_finite() && float > 0.0 {
            return Ok(float);
        }
        Err(self.wrong(at, format!("`{key}` is {value}: it must be finite and above 0")))
    }

    /// A whole number in a range.
    pub(super) fn whole(
        &self,
        key: &str,
        at: &Spanned<Whole>,
        range: RangeInclusive<u32>,
    ) -> Result<u32, LoadError> {
        let value = at.get_ref().0;
        let fits = u32::try_from(value).ok().filter(|value| range.contains(value));
        fits.ok_or_else(|| {
            let (low, high) = range.into_inner();
            self.wrong(at, format!("`{key}` is {value}: it must be from {low} to {high}"))
        })
    }
}

/// As 32-bit floats, if that is finite.
fn finite(value: DVec3) -> Option<Vec3> {
    Some(value.as_vec3()).filter(|value| value.is_finite())
}

/// As it stands in a scene file.
fn show(value: DVec3) -> String {
    format!("[{}, {}, {}]", value.x, value.y, value.z)
}

/// The known name that is nearest to `name`, if one is near enough to be a slip of the fingers.
pub(super) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let (distance, best) =
        known.into_iter().map(|known| (edit_distance(name, known), known)).min()?;
    (distance <= 1 + name.chars().count() / 4).then_some(best)
}

/// How many characters must be put in, taken out, replaced or swapped with their neighbour (optimal
/// string alignment), regardless of case.
fn edit_distance(from: &str, to: &str) -> usize {
    let from: Vec<char> = from.to_lowercase().chars().collect();
    let to: Vec<char> = to.to_lowercase().chars().collect();
    // Row `i` holds the distances of the first `i` characters of `from`.
    let mut rows: Vec<Vec<usize>> = vec![(0..=to.len()).collect()];
    for i in 1..=from.len() {
        let mut row = vec![i];
        for j in 1..=to.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(from[i - 1] != to[j - 1]);
            let mut best = replaced.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && from[i - 1] == to[j - 2] && from[i - 2] == to[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            row.push(best);
        }
        rows.push(row);
    }
    rows[from.len()][to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_found() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("rde", "red"), 1);
        assert_eq!(nearest("whit", ["red", "white", "green"]), Some("white"));
        assert_eq!(nearest("Red", ["red", "white"]), Some("red"));
        assert_eq!(nearest("gold", ["red", "white"]), None);
        assert_eq!(nearest("gold", []), None);
    }
}
