//! The rows of an element, value by value, straight from the parser to whoever wants them: no row
//! is kept and none allocates. All numbers of PLY files fit into doubles.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};

use super::tracked::Track;

/// Who takes the values of an element's rows. An error is what is wrong with the last of them.
pub(super) trait Sink {
    /// A value of a property that is one number.
    fn scalar(&mut self, _property: usize, _value: f64) {}

    /// A value of a property that is a list.
    fn item(&mut self, _property: usize, _value: f64) -> Result<(), String> {
        Ok(())
    }

    /// The row is complete.
    fn end(&mut self) {}
}

/// Takes nothing.
pub(super) struct Nobody;

impl Sink for Nobody {}

/// An element being read, for the parser.
pub(super) struct Rows<'a, S> {
    pub(super) sink: &'a mut S,
    /// How many properties a row has.
    pub(super) properties: usize,
    /// The place in a text; none in a binary file.
    pub(super) track: Option<&'a Track>,
    /// How many rows are complete.
    pub(super) done: usize,
    /// The property whose value comes next.
    pub(super) property: usize,
    /// What is wrong, if it was not the parser that found it.
    pub(super) wrong: Option<String>,
}

impl<S> Rows<'_, S> {
    fn refuse<E: Error>(&mut self, what: String) -> E {
        let error = E::custom(&what);
        self.wrong = Some(what);
        error
    }

    /// In a text each row is a line: a number too many would shift all that follow.
    fn check_line<E: Error>(&mut self, row: &mut Option<usize>, last: usize) -> Result<(), E> {
        let Some(track) = self.track else { return Ok(()) };
        let line = track.word().line;
        match *row {
            None if line == last => {
                let what = format!("the line has more than its {} properties", self.properties);
                Err(self.refuse(what))
            }
            Some(row) if line != row => {
                let what = format!("line {row} ends before its {} properties", self.properties);
                Err(self.refuse(what))
            }
            _ => {
                *row = Some(line);
                Ok(())
            }
        }
    }
}

impl<'de, S: Sink> DeserializeSeed<'de> for &mut Rows<'_, S> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, S: Sink> Visitor<'de> for &mut Rows<'_, S> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("rows")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut rows: A) -> Result<(), A::Error> {
        // Rows of nothing take no bytes: there could be any number of them.
        while self.properties > 0 && rows.next_element_seed(Row(&mut *self))?.is_some() {
            self.sink.end();
            self.done += 1;
        }
        Ok(())
    }
}

/// One row.
struct Row<'a, 'b, S>(&'a mut Rows<'b, S>);

impl<'de, S: Sink> DeserializeSeed<'de> for Row<'_, '_, S> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de, S: Sink> Visitor<'de> for Row<'_, '_, S> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a row")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut row: A) -> Result<(), A::Error> {
        let rows = self.0;
        let last = rows.track.map_or(0, |track| track.word().line);
        let mut line = None;
        for property in 0..rows.properties {
            rows.property = property;
            row.next_key::<IgnoredAny>()?;
            row.next_value_seed(Value { rows: &mut *rows, is_item: false })?;
            rows.check_line(&mut line, last)?;
        }
        Ok(())
    }
}

/// One property of a row, or one item of its list.
struct Value<'a, 'b, S> {
    rows: &'a mut Rows<'b, S>,
    is_item: bool,
}

impl<'de, S: Sink> DeserializeSeed<'de> for Value<'_, '_, S> {
    type Value = ();

    #[inline]
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

macro_rules! numbers {
    ($($visit:ident $number:ty),*) => {$(
        #[inline]
        fn $visit<E: Error>(self, value: $number) -> Result<(), E> {
            self.take(f64::from(value))
        }
    )*};
}

impl<S: Sink> Value<'_, '_, S> {
    #[inline]
    fn take<E: Error>(self, value: f64) -> Result<(), E> {
        let rows = self.rows;
        if !self.is_item {
            rows.sink.scalar(rows.property, value);
            return Ok(());
        }
        rows.sink.item(rows.property, value).map_err(|what| rows.refuse(what))
    }
}

impl<'de, S: Sink> Visitor<'de> for Value<'_, '_, S> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or a list of numbers")
    }

    numbers!(
        visit_i8 i8, visit_u8 u8, visit_i16 i16, visit_u16 u16,
        visit_i32 i32, visit_u32 u32, visit_f32 f32, visit_f64 f64
    );

    #[inline]
    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        loop {
            let item = Value { rows: &mut *self.rows, is_item: true };
            if items.next_element_seed(item)?.is_none() {
                return Ok(());
            }
        }
    }
}
