//! Shapes, poses and surfaces out of a scene file.

use god_object::{ForceShading, Pose, SineTexture, Surface, Texture};
use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};

use super::parse_mesh_file::mesh_file;
use super::spec::{HeightMapMapping, HeightMapSpec, Shape, VisualSpec};
use crate::document::{Range, Section, Value, table};
use crate::shapes::{Axis, BoardText, PLATE, board_fault, hole_circumradius};
use taut_recording::unit_quaternion;

/// Sides of a prism: fewer make no prism, more make slivers that no hand feels.
const FACETS: (i64, i64) = (3, 4096);
/// Sides of a hole and meridians of a capsule.
const ROUND_FACETS: (i64, i64) = (8, 4096);
/// Most subdivisions of a sphere: 1.3 million triangles.
const MAX_SUBDIVISIONS: i64 = 8;
/// Sides of a hole that names none, as in the paper.
const HOLE_FACETS: usize = 66;
/// Length of a hand that names none, m: the mean of adults.
const HAND: f64 = 0.19;
/// Largest angle between faces, rad.
const HALF_TURN: f64 = std::f64::consts::PI;

const AXES: [(&str, Axis); 3] = [("x", Axis::X), ("y", Axis::Y), ("z", Axis::Z)];

/// Reads one primitive's table.
type ReadPrimitive = fn(&Section<'_>) -> Option<Shape>;

/// `shape = { ... }` of what is touched; complaints go to the section.
pub(super) fn shape(body: &Section<'_>) -> Option<Shape> {
    let shape = shape_of(body, "shape")?;
    if matches!(shape, Shape::Hand { .. } | Shape::Board { .. }) {
        let text = "`hand` and `board` are only seen; write them as the shape of a [[scenery]], or as a `visual`";
        body.complain_of("shape", text);
        return None;
    }
    Some(shape)
}

/// The same of what is only seen.
pub(super) fn seen_shape(body: &Section<'_>) -> Option<Shape> {
    shape_of(body, "shape")
}

/// `visual = { ... }`, in the same words; complaints go to the section.
pub(super) fn visual(body: &Section<'_>) -> Option<VisualSpec> {
    let at = body.get("visual")?.at.clone();
    let shape = shape_of(body, "visual")?;
    if shape.simplify().is_some() {
        let text = "`simplify` has no meaning for `visual`, which costs no collision detection; leave it out";
        body.complain(&at, text);
    }
    Some(VisualSpec { shape, at })
}

fn shape_of(body: &Section<'_>, key: &'static str) -> Option<Shape> {
    if key == "shape" {
        let example = "shape = { mesh = \"body.ply\" } or { sphere = { radius = 0.01 } }";
        body.require(key, example);
    }
    let shape = body.section(key)?;
    let mut found = Vec::new();
    found.extend(mesh_file(&shape).map(Some));
    let primitives: [(&'static str, ReadPrimitive); 8] = [
        ("sphere", sphere),
        ("box", cuboid),
        ("capsule", capsule),
        ("cylinder", cylinder),
        ("box_with_hole", box_with_hole),
        ("plane", plane),
        ("hand", hand),
        ("board", board),
    ];
    for (key, read) in primitives {
        if let Some(primitive) = shape.section(key) {
            found.push(read(&primitive));
            primitive.finish();
        } else if shape.has(key) {
            found.push(None); // already complained of
        }
    }
    let count = found.len();
    let wrong_mesh = shape.has("mesh") && count == 0;
    if count != 1 && !wrong_mesh {
        let text = format!(
            "{} names {count} forms, but must name one: mesh, sphere, box, capsule, cylinder, box_with_hole or plane",
            shape.name()
        );
        shape.complain(shape.at(), text);
    }
    shape.finish();
    found.pop().flatten().filter(|_| count == 1)
}

fn axis(section: &Section<'_>, default: Axis) -> Axis {
    section.choice("axis", &AXES).unwrap_or(default)
}

fn facets(section: &Section<'_>, (low, high): (i64, i64)) -> Option<usize> {
    section.integer("facets", low, high)
}

fn radius(section: &Section<'_>) -> Option<f64> {
    section.required_number("radius", Range::Positive, "radius = 0.01")
}

fn half_length(section: &Section<'_>) -> Option<f64> {
    section.required_number("half_length", Range::Positive, "half_length = 0.03")
}

fn half_extents(section: &Section<'_>) -> Option<[f64; 3]> {
    section.require("half_extents", "half_extents = [0.03, 0.03, 0.03]");
    section.numbers("half_extents", Range::Positive)
}

fn sphere(section: &Section<'_>) -> Option<Shape> {
    let subdivisions = section.integer("subdivisions", 0, MAX_SUBDIVISIONS);
    Some(Shape::Sphere {
        radius: radius(section)?,
        subdivisions,
    })
}

fn cuboid(section: &Section<'_>) -> Option<Shape> {
    Some(Shape::Box {
        half_extents: half_extents(section)?,
    })
}

fn capsule(section: &Section<'_>) -> Option<Shape> {
    let (facets, axis) = (facets(section, ROUND_FACETS), axis(section, Axis::Y));
    let (radius, half_length) = (radius(section), half_length(section));
    Some(Shape::Capsule {
        radius: radius?,
        half_length: half_length?,
        facets,
        axis,
    })
}

fn cylinder(section: &Section<'_>) -> Option<Shape> {
    let (facets, axis) = (facets(section, FACETS), axis(section, Axis::Y));
    let (radius, half_length) = (radius(section), half_length(section));
    Some(Shape::Cylinder {
        radius: radius?,
        half_length: half_length?,
        facets,
        axis,
    })
}

fn box_with_hole(section: &Section<'_>) -> Option<Shape> {
    let facets = facets(section, ROUND_FACETS).unwrap_or(HOLE_FACETS);
    let axis = axis(section, Axis::Y);
    let (radius, half_extents) = (radius(section), half_extents(section));
    let (radius, half_extents) = (radius?, half_extents?);
    let [u, v, _] = axis.split(half_extents);
    let room = u.min(v);
    let needed = hole_circumradius(radius, facets);
    if needed >= room {
        let text = format!(
            "the hole of {} reaches {needed} m from its axis, but the box only {room} m; make the radius smaller or the box larger",
            section.name()
        );
        section.complain(section.at(), text);
        return None;
    }
    Some(Shape::BoxWithHole {
        half_extents,
        radius,
        facets,
        axis,
    })
}

fn plane(section: &Section<'_>) -> Option<Shape> {
    let axis = axis(section, Axis::Z);
    let size = section.number_or("size", Range::Positive, PLATE[0]);
    let thickness = section.number_or("thickness", Range::Positive, PLATE[1]);
    let bounded = section.has("size") || section.has("thickness");
    Some(Shape::Plane {
        plate: bounded.then_some([size, thickness]),
        axis,
    })
}

fn hand(section: &Section<'_>) -> Option<Shape> {
    let sides = [("right", false), ("left", true)];
    Some(Shape::Hand {
        length: section.number_or("length", Range::Positive, HAND),
        is_left: section.choice("side", &sides).unwrap_or(false),
    })
}

fn board(section: &Section<'_>) -> Option<Shape> {
    let written = |key| section.text(key).unwrap_or_default().to_owned();
    let text = BoardText {
        title: written("title"),
        text: written("text"),
    };
    if text.title.is_empty() && text.text.is_empty() {
        section.complain_missing("title", "title = \"Peg in a hole\"");
    }
    let width = section.required_number("width", Range::Positive, "width = 0.3");
    if let Some(fault) = board_fault(&text) {
        section.complain(section.at(), format!("{} {fault}", section.name()));
        return None;
    }
    Some(Shape::Board {
        text,
        width: width?,
    })
}

/// `pose = { position, rotation }`; what is left out is zero or no rotation.
pub(super) fn pose(body: &Section<'_>) -> Option<Pose> {
    if !body.has("pose") {
        return Some(Pose::identity());
    }
    table(body, "pose", pose_of).flatten()
}

/// The pose in a table that holds `position` and `rotation`.
pub(crate) fn pose_of(section: &Section<'_>) -> Option<Pose> {
    let position = match section.has("position") {
        true => section.numbers::<3>("position", Range::Finite),
        false => Some([0.0; 3]),
    };
    let rotation = match section.has("rotation") {
        true => rotation_of(section)?,
        false => UnitQuaternion::identity(),
    };
    Some(Pose::from_parts(Translation3::from(position?), rotation))
}

/// `rotation`, w x y z, if it is there and a rotation.
pub(crate) fn rotation_of(section: &Section<'_>) -> Option<UnitQuaternion<f64>> {
    let wxyz = section.numbers::<4>("rotation", Range::Finite)?;
    unit_quaternion(wxyz)
        .map_err(|text| {
            let text = format!("`rotation` in {}: {text}", section.name());
            section.complain_of("rotation", text);
        })
        .ok()
}

/// `surface = { shading, texture, friction }`, all optional.
pub(super) fn surface(body: &Section<'_>) -> (Surface, Option<HeightMapSpec>) {
    table(body, "surface", surface_of).unwrap_or_default()
}

fn surface_of(section: &Section<'_>) -> (Surface, Option<HeightMapSpec>) {
    let angle = table(section, "shading", |shading| {
        shading.required_number("crease_angle", Range::UpTo(HALF_TURN), "crease_angle = 0.6")
    });
    let (sine, map) = table(section, "texture", texture).unwrap_or_default();
    let surface = Surface {
        shading: angle
            .flatten()
            .map(|crease_angle| ForceShading { crease_angle }),
        texture: sine.map(Texture::Sine),
        friction: section.number_or("friction", Range::NotNegative, 0.0),
    };
    (surface, map)
}

fn texture(section: &Section<'_>) -> (Option<SineTexture>, Option<HeightMapSpec>) {
    match (section.has("sine"), section.has("height_map")) {
        (true, true) => {
            let name = section.name();
            let text = format!("{name} has both `sine` and `height_map`; leave one out");
            section.complain(section.at(), text);
        }
        (false, false) => section.complain_missing(
            "sine",
            "sine = { axis = \"x\", wavelength = 2e-3, amplitude = 0.2 } or height_map = { file = \"leather.png\", tile = 0.05, amplitude = 2e-4 }",
        ),
        _ => {}
    }
    let sine = table(section, "sine", sine_texture).flatten();
    (sine, table(section, "height_map", height_map).flatten())
}

fn height_map(section: &Section<'_>) -> Option<HeightMapSpec> {
    let path = section.required_text("file", "file = \"leather.png\"");
    let amplitude = section.required_number("amplitude", Range::NotNegative, "amplitude = 2e-4");
    let by_coordinates = section.choice("mapping", &[("triplanar", false), ("uv", true)]);
    let mapping = if by_coordinates.unwrap_or(false) {
        if section.has("tile") {
            section.fault(
                "tile",
                "has no meaning with mapping = \"uv\", where the picture covers 0 to 1 of the mesh's texture coordinates; leave it out",
            );
        }
        Some(HeightMapMapping::Uv)
    } else {
        section
            .required_number("tile", Range::Positive, "tile = 0.05")
            .map(|tile| HeightMapMapping::Triplanar { tile })
    };
    let at = section.at_key("file");
    Some(HeightMapSpec {
        path: path?.to_owned(),
        mapping: mapping?,
        amplitude: amplitude?,
        at: at.clone(),
    })
}

fn sine_texture(sine: &Section<'_>) -> Option<SineTexture> {
    let axis = match sine.get("axis") {
        None => {
            sine.complain_missing("axis", "axis = \"x\"");
            None
        }
        Some(node) if matches!(node.value, Value::Array(_)) => {
            let direction = sine.numbers::<3>("axis", Range::Finite).map(Vector3::from);
            let unit = direction.and_then(|d| Unit::try_new(d, f64::MIN_POSITIVE));
            if direction.is_some() && unit.is_none() {
                sine.fault("axis", "has no direction; write a vector that is not zero");
            }
            unit.map(Unit::into_inner)
        }
        Some(_) => sine.choice("axis", &AXES).map(Axis::unit),
    };
    let wavelength = sine.required_number("wavelength", Range::Positive, "wavelength = 2e-3");
    let amplitude = sine.required_number("amplitude", Range::NotNegative, "amplitude = 0.2");
    Some(SineTexture {
        axis: axis?,
        wavelength: wavelength?,
        amplitude: amplitude?,
    })
}
