//! How bodies look, and what is only seen, out of a scene file.

use super::edit::object_name;
use super::parse_shape::{pose, seen_shape};
use super::spec::{Carrier, ObstacleSpec, ScenerySpec, Shape};
use crate::appearance::{Appearance, colour_of_text};
use crate::document::{Range, Section, Value};

/// Most pieces of scenery: with the obstacles they fit a description on the wire.
const MAX_SCENERY: usize = 1024;

const CARRIERS: [(&str, Carrier); 2] = [
    ("god-object", Carrier::GodObject),
    ("device", Carrier::Device),
];

/// `[[scenery]]`: what is drawn and never touched.
pub(super) fn scenery(root: &Section<'_>, obstacles: &[ObstacleSpec]) -> Vec<ScenerySpec> {
    let mut scenery: Vec<ScenerySpec> = Vec::new();
    for section in root.sections("scenery") {
        if scenery.len() >= MAX_SCENERY {
            let text = format!("there are more than {MAX_SCENERY} [[scenery]]; join some meshes");
            section.complain(section.at(), text);
            return scenery;
        }
        let name = object_name(&section, "name = \"room\"");
        if let Some(name) = &name {
            let mut others = obstacles.iter().map(|other| &other.name);
            if others.any(|other| other == name) || scenery.iter().any(|other| other.name == *name)
            {
                let text = format!("there are two bodies of the name \"{name}\"; rename one");
                section.complain_of("name", text);
            }
        }
        let shape_at = section.at_key("shape").clone();
        let (shape, pose) = (seen_shape(&section), pose(&section));
        let carrier = section.choice("carried_by", &CARRIERS);
        if shape.as_ref().and_then(Shape::simplify).is_some() {
            let text = "`simplify` has no meaning for [[scenery]], which costs no collision detection; leave it out";
            section.complain(&shape_at, text);
        }
        let appearance = appearance(&section);
        section.finish();
        if let (Some(name), Some(shape), Some(pose)) = (name, shape, pose) {
            scenery.push(ScenerySpec {
                name,
                shape,
                pose,
                carrier,
                appearance,
                shape_at,
            });
        }
    }
    scenery
}

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

/// `"#rrggbb"` or a name of CSS, sRGB, or `[r, g, b]`, linear.
fn color(body: &Section<'_>) -> Option<[f32; 3]> {
    const WANTED: &str =
        "\"#rrggbb\", a CSS name such as \"red\", or [r, g, b] with numbers between 0 and 1";
    match &body.get("color")?.value {
        Value::Array(_) => {
            let parts = body.numbers::<3>("color", Range::UpTo(1.0))?;
            Some(parts.map(|part| part as f32))
        }
        Value::Text(text) => {
            let colour = colour_of_text(text);
            if colour.is_none() {
                body.fault("color", format_args!("is \"{text}\", but must be {WANTED}"));
            }
            colour
        }
        other => {
            let kind = other.kind();
            body.fault("color", format_args!("is {kind}, but must be {WANTED}"));
            None
        }
    }
}
