//! How bodies look, out of a scene file.

use crate::appearance::{Appearance, colour_of_text};
use crate::document::{Range, Section, Value};

/// `color`, `roughness`, `metallic` and `opacity` of a body.
pub(super) fn appearance(body: &Section<'_>) -> Appearance {
    let share = |key| body.number(key, Range::UpTo(1.0)).map(|value| value as f32);
    Appearance {
        color: color(body),
        roughness: share("roughness"),
        metallic: share("metallic"),
        opacity: share("opacity"),
    }
}

/// `"#rrggbb"`, sRGB, or `[r, g, b]`, linear.
fn color(body: &Section<'_>) -> Option<[f32; 3]> {
    const WANTED: &str = "\"#rrggbb\", or [r, g, b] with numbers between 0 and 1";
    let node = body.get("color")?;
    match &node.value {
        Value::Array(_) => {
            let parts = body.numbers::<3>("color", Range::UpTo(1.0))?;
            Some(parts.map(|part| part as f32))
        }
        Value::Text(text) => {
            let colour = colour_of_text(text);
            if colour.is_none() {
                let text = format!(
                    "`color` in {} is \"{text}\", but must be {WANTED}",
                    body.name()
                );
                body.complain(&node.at, text);
            }
            colour
        }
        other => {
            let text = format!(
                "`color` in {} is {}, but must be {WANTED}",
                body.name(),
                other.kind()
            );
            body.complain(&node.at, text);
            None
        }
    }
}
