//! Shapes from mesh files out of a scene file: unit, scale, pieces, simplification.

use super::spec::Shape;
use crate::document::{Range, Section, table};

/// Units that a mesh file may be in, and what they are in metres.
pub(crate) const LENGTH_UNITS: [(&str, f64); 6] = [
    ("m", 1.0),
    ("dm", 0.1),
    ("cm", 0.01),
    ("mm", 1e-3),
    ("um", 1e-6),
    ("inch", 0.0254),
];

/// `mesh = "file"` and the keys that go with it.
pub(super) fn mesh_file(shape: &Section<'_>) -> Option<Shape> {
    let path = shape.text("mesh")?;
    let unit = shape.choice("unit", &LENGTH_UNITS).unwrap_or(1.0);
    Some(Shape::Mesh {
        path: path.to_owned(),
        scale: unit * shape.number_or("scale", Range::Positive, 1.0),
        is_scaled: shape.has("unit") || shape.has("scale"),
        only: only(shape),
        simplify: simplify(shape),
    })
}

/// `only = ["name"]`: which pieces of the file.
fn only(shape: &Section<'_>) -> Vec<String> {
    let Some(names) = shape.texts("only") else {
        return Vec::new();
    };
    if names.is_empty() {
        shape.fault(
            "only",
            "names no piece; write names of nodes, objects or groups, as only = [\"peg\"], or leave it out",
        );
    }
    names.into_iter().map(|(name, _)| name.to_owned()).collect()
}

/// `simplify = { max_error }`: the most distance, m.
fn simplify(shape: &Section<'_>) -> Option<f64> {
    let max_error = table(shape, "simplify", |section| {
        section.required_number("max_error", Range::Positive, "max_error = 1e-4")
    });
    max_error.flatten()
}
