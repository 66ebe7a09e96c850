//! A scene out of its document. Every fault is reported, each with its line.

use std::cell::RefCell;

use nalgebra::Point3;
use taut_plant::HandPreset;

use super::edit::object_name;
use super::parse_look::{appearance, scenery};
use super::parse_shape::{pose, rotation_of, shape, surface, visual};
use super::settings_tables::{CouplingSpec, LimitSpec, MethodSpec};
use super::spec::{
    BodySpec, EnvironmentSpec, HandPathSpec, MassSpec, MotionSpec, ObstacleSpec, ReferencePoint,
    ScenerySpec, Shape, View,
};
use crate::document::{Document, Range, Section, Value, table};
use crate::fidelity::FidelitySpec;
use crate::fidelity::spec::fidelity;
use crate::problem::FileError;

/// Most obstacles: the method counts them in 16 bits.
pub(crate) const MAX_OBSTACLES: usize = 1 << 16;

/// What a scene file says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SceneSpec {
    pub(super) name: String,
    pub(super) god_object: BodySpec,
    pub(super) obstacles: Vec<ObstacleSpec>,
    pub(super) scenery: Vec<ScenerySpec>,
    pub(super) coupling: CouplingSpec,
    pub(super) limits: LimitSpec,
    pub(super) method: MethodSpec,
    pub(super) hand: Option<HandPathSpec>,
    pub(super) view: View,
    pub(super) environment: Option<EnvironmentSpec>,
    pub(super) fidelity: Option<FidelitySpec>,
}

/// The scene's name: a single line, because it is printed and sent.
fn scene_name(root: &Section<'_>) -> Option<String> {
    let name = root.required_text("name", "name = \"my-scene\"")?;
    if name.contains(char::is_control) {
        let text = format!("the name {name:?} has a control character; write another");
        root.complain_of("name", text);
    }
    Some(name.to_owned())
}

pub(super) fn parse(document: &Document) -> Result<SceneSpec, FileError> {
    let problems = RefCell::new(Vec::new());
    let root = Section::root(&document.root, &problems);
    let name = scene_name(&root);
    root.require("god_object", "the table [god_object] with shape and mass");
    let god_object = table(&root, "god_object", god_object).flatten();
    let obstacles = obstacles(&root);
    let scenery = scenery(&root, &obstacles);
    let coupling = table(&root, "coupling", CouplingSpec::read).unwrap_or_default();
    let limits = table(&root, "limits", LimitSpec::read).unwrap_or_default();
    let method = table(&root, "method", MethodSpec::read).unwrap_or_default();
    let hand = table(&root, "hand", hand).flatten();
    let (view, environment) = table(&root, "view", view).unwrap_or_default();
    let fidelity = fidelity(&root);
    root.finish();
    let mut found = problems.into_inner();
    // In the order of the file, overrides last.
    found.sort_by_key(|problem| problem.line.unwrap_or(usize::MAX));
    let (Some(name), Some(god_object), true) = (name, god_object, found.is_empty()) else {
        FileError::unless_empty(found)?;
        return Err(document
            .root
            .at
            .problem("is no scene; give it a name and a god_object")
            .into());
    };
    Ok(SceneSpec {
        name,
        god_object,
        obstacles,
        scenery,
        coupling,
        limits,
        method,
        hand,
        view,
        environment,
        fidelity,
    })
}

fn god_object(section: &Section<'_>) -> Option<BodySpec> {
    let shape = shape(section).map(Shape::held);
    let mass = mass(section);
    let pose = pose(section);
    let reference_point = reference_point(section);
    let appearance = appearance(section);
    let visual = visual(section);
    Some(BodySpec {
        shape: shape?,
        mass: mass?,
        pose: pose?,
        reference_point: reference_point?,
        appearance,
        visual,
        at: section.at().clone(),
        shape_at: section.at_key("shape").clone(),
    })
}

fn mass(section: &Section<'_>) -> Option<MassSpec> {
    let mass = section.number("mass", Range::Positive).map(MassSpec::Mass);
    let density = section
        .number("density", Range::Positive)
        .map(MassSpec::Density);
    match (section.has("mass"), section.has("density")) {
        (true, true) => {
            let name = section.name();
            let text = format!("{name} has both `mass` and `density`; leave one out");
            section.complain_of("density", text);
            None
        }
        (false, false) => {
            section.complain_missing("mass", "mass = 1.0 (kg) or density = 1000.0 (kg/m^3)");
            None
        }
        _ => mass.or(density),
    }
}

fn reference_point(section: &Section<'_>) -> Option<ReferencePoint> {
    match section.get("reference_point") {
        None => Some(ReferencePoint::CenterOfMass),
        Some(node) if matches!(node.value, Value::Array(_)) => {
            let point = section.numbers::<3>("reference_point", Range::Finite)?;
            Some(ReferencePoint::At(Point3::from(point)))
        }
        Some(_) => section.choice(
            "reference_point",
            &[("center-of-mass", ReferencePoint::CenterOfMass)],
        ),
    }
}

fn obstacles(root: &Section<'_>) -> Vec<ObstacleSpec> {
    let mut obstacles: Vec<ObstacleSpec> = Vec::new();
    for section in root.sections("obstacle") {
        let shape_at = section.at_key("shape").clone();
        let name = object_name(&section, "name = \"box\"");
        if let Some(name) = &name
            && obstacles.iter().any(|other| other.name == *name)
        {
            let text = format!("there are two obstacles of the name \"{name}\"; rename one");
            section.complain_of("name", text);
        }
        let (shape, pose) = (shape(&section), pose(&section));
        let (surface, height_map) = surface(&section);
        let motion = table(&section, "motion", motion).flatten();
        if section.has("pose") && section.has("motion") {
            section.fault(
                "pose",
                "has no meaning beside `motion`, whose trace says where the obstacle is; leave it out",
            );
        }
        let appearance = appearance(&section);
        let visual = visual(&section);
        if obstacles.len() >= MAX_OBSTACLES {
            let text = format!("there are more than {MAX_OBSTACLES} obstacles; join some meshes");
            section.complain(section.at(), text);
            return obstacles;
        }
        section.finish();
        if let (Some(name), Some(shape), Some(pose)) = (name, shape, pose) {
            obstacles.push(ObstacleSpec {
                name,
                shape,
                pose,
                surface,
                motion,
                appearance,
                visual,
                height_map,
                shape_at,
            });
        }
    }
    obstacles
}

fn motion(section: &Section<'_>) -> Option<MotionSpec> {
    let repeat = section.boolean("loop").unwrap_or(false);
    let trace = section.required_text("trace", "trace = \"plate.csv\"")?;
    Some(MotionSpec {
        trace: trace.to_owned(),
        repeat,
        at: section.at_key("trace").clone(),
    })
}

fn hand(section: &Section<'_>) -> Option<HandPathSpec> {
    let repeat = section.boolean("loop").unwrap_or(false);
    let preset = section.choice("preset", &HandPreset::NAMED);
    let path = section.required_text("path", "path = \"hand.csv\"")?;
    Some(HandPathSpec {
        path: path.to_owned(),
        repeat,
        preset: preset.unwrap_or_default(),
        at: section.at_key("path").clone(),
    })
}

fn view(section: &Section<'_>) -> (View, Option<EnvironmentSpec>) {
    let display_scale = section.number_or("display_scale", Range::Positive, 1.0);
    let origin = section
        .numbers::<3>("origin", Range::Finite)
        .map(Point3::from);
    let rotation = rotation_of(section);
    let environment = section.text("environment").map(|path| EnvironmentSpec {
        path: path.to_owned(),
        at: section.at_key("environment").clone(),
    });
    let view = View {
        display_scale,
        origin,
        rotation,
    };
    (view, environment)
}
