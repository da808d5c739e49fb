//! The values that scene files are made of, each with an `expected ..` that says how to write it.
//!
//! They take what TOML has and no more: a number may lack its point (`1`), an array must have the
//! right length, nothing is converted from text. Ranges are checked later, where keys are known.

use std::fmt;

use glam::DVec3;
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};

/// Any number; may be NaN or infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Number(pub(super) f64);

/// An integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Whole(pub(super) i64);

/// Exactly three numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Triple(pub(super) DVec3);

/// Three numbers, or one that stands for all three: colours and scales.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OneOrThree(pub(super) DVec3);

/// Four rows of four numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Matrix(pub(super) [[f64; 4]; 4]);

/// A rotation in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rotation {
    /// About x, then y, then z, each the axis of the scene.
    Angles(DVec3),
    /// About one axis through the origin, counterclockwise when it points at the viewer.
    Axis { axis: DVec3, degrees: f64 },
}

/// The table form of a [`Rotation`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisRotation {
    axis: Triple,
    degrees: Number,
}

/// Implements `Deserialize` by a visitor that takes `any` of the listed forms.
macro_rules! deserialize {
    ($value:ident, $expecting:literal $(, $form:ident)*) => {
        impl<'de> Deserialize<'de> for $value {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Visit;
                impl<'de> Visitor<'de> for Visit {
                    type Value = $value;

                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        f.write_str($expecting)
                    }

                    $(deserialize!(@$form $value);)*
                }
                deserializer.deserialize_any(Visit)
            }
        }
    };
    (@integer $value:ident) => {
        fn visit_i64<E: de::Error>(self, value: i64) -> Result<$value, E> {
            Ok($value::from_integer(value))
        }
    };
    (@float $value:ident) => {
        fn visit_f64<E: de::Error>(self, value: f64) -> Result<$value, E> {
            Ok($value::from_float(value))
        }
    };
    (@array $value:ident) => {
        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<$value, A::Error> {
            let mut values = Vec::new();
            while let Some(value) = seq.next_element()? {
                values.push(value);
            }
            $value::from_values(&values)
                .ok_or_else(|| de::Error::invalid_length(values.len(), &self))
        }
    };
    (@table $value:ident) => {
        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<$value, A::Error> {
            AxisRotation::deserialize(MapAccessDeserializer::new(map)).map($value::from_table)
        }
    };
}

deserialize!(Number, "a number", integer, float);
deserialize!(Whole, "a whole number", integer);
deserialize!(Triple, "three numbers such as [0, 1.5, 0]", array);
deserialize!(
    OneOrThree,
    "three numbers such as [0.8, 0.2, 0.1], or one for all three",
    integer,
    float,
    array
);
deserialize!(Matrix, "four rows of four numbers", array);
deserialize!(
    Rotation,
    "three angles in degrees such as [0, 45, 0], or { axis = [0, 1, 0], degrees = 45 }",
    array,
    table
);

impl Number {
    fn from_integer(value: i64) -> Self {
        Self(value as f64)
    }

    fn from_float(value: f64) -> Self {
        Self(value)
    }
}

impl Whole {
    fn from_integer(value: i64) -> Self {
        Self(value)
    }
}

impl Triple {
    fn from_values(values: &[Number]) -> Option<Self> {
        let &[x, y, z] = values else { return None };
        Some(Self(DVec3::new(x.0, y.0, z.0)))
    }
}

impl OneOrThree {
    fn from_integer(value: i64) -> Self {
        Self(DVec3::splat(value as f64))
    }

    fn from_float(value: f64) -> Self {
        Self(DVec3::splat(value))
    }

    fn from_values(values: &[Number]) -> Option<Self> {
        Triple::from_values(values).map(|triple| Self(triple.0))
    }
}

impl Matrix {
    fn from_values(rows: &[Vec<Number>]) -> Option<Self> {
        let mut matrix = [[0.0; 4]; 4];
        if rows.len() != 4 {
            return None;
        }
        for (to, from) in matrix.iter_mut().zip(rows) {
            let &[a, b, c, d] = &from[..] else { return None };
            *to = [a.0, b.0, c.0, d.0];
        }
        Some(Self(matrix))
    }
}

impl Rotation {
    fn from_values(values: &[Number]) -> Option<Self> {
        Triple::from_values(values).map(|triple| Self::Angles(triple.0))
    }

    fn from_table(table: AxisRotation) -> Self {
        Self::Axis { axis: table.axis.0, degrees: table.degrees.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    struct Key<T> {
        key: T,
    }

    fn read<T: for<'de> Deserialize<'de>>(text: &str) -> Result<T, String> {
        let read = toml::from_str::<Key<T>>(&format!("key = {text}"));
        read.map(|key| key.key).map_err(|error| error.message().to_owned())
    }

    #[test]
    fn values_take_their_forms() {
        assert_eq!(read("1"), Ok(Number(1.0)));
        assert_eq!(read("-1.5e3"), Ok(Number(-1500.0)));
        assert_eq!(read("7"), Ok(Whole(7)));
        assert_eq!(read("[1, 2.5, 3]"), Ok(Triple(DVec3::new(1.0, 2.5, 3.0))));
        assert_eq!(read("0.5"), Ok(OneOrThree(DVec3::splat(0.5))));
        assert_eq!(read("2"), Ok(OneOrThree(DVec3::splat(2.0))));
        assert_eq!(read("[1, 0, 0]"), Ok(OneOrThree(DVec3::X)));
        assert_eq!(read("[0, 90, 0]"), Ok(Rotation::Angles(DVec3::Y * 90.0)));
        let axis = Rotation::Axis { axis: DVec3::Z, degrees: 30.0 };
        assert_eq!(read("{ axis = [0, 0, 1], degrees = 30 }"), Ok(axis));
        let rows = "[[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]";
        assert_eq!(read::<Matrix>(rows).unwrap().0[1], [0.0, 1.0, 0.0, 5.0]);
    }

    #[test]
    fn other_forms_say_what_is_expected() {
        let wrong = |error: Result<(), String>| error.unwrap_err();
        assert_eq!(
            wrong(read::<Triple>("[1, 2]").map(|_| ())),
            "invalid length 2, expected three numbers such as [0, 1.5, 0]"
        );
        assert!(wrong(read::<Triple>("[1, 2, 3, 4]").map(|_| ())).starts_with("invalid length 4"));
        assert_eq!(
            wrong(read::<Number>("\"1\"").map(|_| ())),
            "invalid type: string \"1\", expected a number"
        );
        assert_eq!(
            wrong(read::<Whole>("1.5").map(|_| ())),
            "invalid type: floating point `1.5`, expected a whole number"
        );
        assert!(wrong(read::<Matrix>("[[1, 2], [3, 4]]").map(|_| ())).contains("four rows"));
        assert!(wrong(read::<Rotation>("90").map(|_| ())).contains("three angles in degrees"));
        assert!(wrong(read::<Rotation>("{ axis = [0, 1, 0] }").map(|_| ())).contains("degrees"));
        let unknown = "{ axis = [0, 1, 0], degrees = 1, angle = 2 }";
        assert!(wrong(read::<Rotation>(unknown).map(|_| ())).contains("angle"));
    }
}
