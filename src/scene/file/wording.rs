//! The messages of serde and of the TOML parser in the words of `docs/scene-files.md`.

use super::check::nearest;

/// Serde's words and ours. Only at the places where serde itself put them: what a user wrote stands
/// in quotes and is not touched.
const WORDS: [(&str, &str); 9] = [
    ("unknown field `", "unknown key `"),
    ("missing field `", "missing key `"),
    ("unknown variant `", "unknown value `"),
    ("invalid type: map, ", "invalid type: table, "),
    ("invalid type: sequence, ", "invalid type: array, "),
    (", expected a sequence", ", expected [[..]] tables or an array of tables"),
    (", expected a map", ", expected a table"),
    ("` as i128, expected", "`, expected"),
    (", expected a string", ", expected a string in quotes"),
];

/// One line that says what is wrong, and what would be right where the parser knows.
pub(super) fn of_toml(message: &str) -> String {
    let lines = message.lines().map(str::trim).filter(|line| !line.is_empty());
    let mut message = lines.collect::<Vec<_>>().join("; ");
    for (theirs, ours) in WORDS {
        message = message.replacen(theirs, ours, 1);
    }
    match &message[..] {
        "duplicate key" => {
            return "duplicate key: a key or [table] may be there once; remove one".into();
        }
        "string values must be quoted, expected literal string" => {
            return "there is no value, or a text without quotes: write one, such as 1 or \"name\""
                .into();
        }
        _ => {}
    }
    if message.starts_with("unknown ") {
        let mut names = message.split('`').skip(1).step_by(2);
        let near = names.next().and_then(|name| nearest(name, names));
        if let Some(near) = near {
            return format!("{message}; did you mean `{near}`?");
        }
    }
    message
}

#[cfg(test)]
mod tests {
    use super::of_toml;

    #[test]
    fn messages_are_one_line_with_a_mend() {
        assert_eq!(
            of_toml("unknown field `raduis`, expected one of `center`, `radius`"),
            "unknown key `raduis`, expected one of `center`, `radius`; did you mean `radius`?"
        );
        assert_eq!(
            of_toml("unknown variant `spot`, expected `point` or `area`"),
            "unknown value `spot`, expected `point` or `area`"
        );
        assert_eq!(of_toml("one\n  two\n"), "one; two");
        assert_eq!(
            of_toml("invalid type: integer `3`, expected a sequence"),
            "invalid type: integer `3`, expected [[..]] tables or an array of tables"
        );
    }
}
