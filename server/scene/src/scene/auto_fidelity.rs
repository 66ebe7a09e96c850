//! A scene's fidelity: what it needs, what is chosen, and the choice put into meshes, settings and surfaces.

use god_object::spatial::{angular, linear, pose_difference};
use god_object::{ForceShading, Mesh, Primitive, Settings, Surface};
use nalgebra::{Point3, Vector3};

use super::built::BuiltMotion;
use super::load::Scene;
use super::spec::{MassSpec, ReferencePoint, Shape};
use crate::fidelity::decide::Parts;
use crate::fidelity::errors::{JND_CHANGE, JND_MAGNITUDE, direction_jnd};
use crate::fidelity::need::{CREASE, volume};
use crate::fidelity::{
    BodyNeed, Choice, Chosen, FidelityPlan, FidelitySpec, Fixed, Origin, SceneNeed, decide,
};
use crate::trace::DeviceTrace;

/// Peak of a minimum-jerk motion over its mean speed: 15/8.
const PEAK: f64 = 1.875;
/// What a hand does whose path the scene does not say, m/s and rad/s.
const HAND_SPEED: f64 = 0.2;
const HAND_TURN_RATE: f64 = 1.0;
/// Share of the room between minimum gap and rest distance that the tolerance may fill.
const TOLERANCE_ROOM: f64 = 0.9;
/// What vision may lag behind touch, s (Di Luca and Mahnan 2019), and what of a body's way is seen, m: a pixel at arm's length.
const VISION_LAG: f64 = 0.015;
const PIXEL: f64 = 1.5e-3;
/// Fewest and most states per second, Hz: as most screens, and as the forces.
const BROADCAST_RATES: [f64; 2] = [60.0, 1000.0];
/// Contacts that show how a body lies: one of a smooth pair, the corners of a face else.
const CONTACTS_SMOOTH: u32 = 1;
const CONTACTS_SHARP: u32 = 4;

/// The choice, and how it is put into the scene.
#[derive(Clone, Debug)]
pub(super) struct AutoFidelity {
    pub(super) plan: FidelityPlan,
    pub(super) gap_tolerance: f64,
    pub(super) rounds: u32,
    /// For each body, god-object first; `None` where the file says, or there is nothing to simplify.
    pub(super) mesh_errors: Vec<Option<f64>>,
    /// For each obstacle.
    shading: Vec<bool>,
}

impl AutoFidelity {
    /// Shading where it was chosen.
    pub(super) fn shade(&self, index: usize, surface: &mut Surface) {
        if self.shading.get(index).copied().unwrap_or(false) {
            surface.shading = Some(ForceShading {
                crease_angle: CREASE,
            });
        }
    }
}

impl Scene {
    /// `None` unless the scene asks for it. The meshes are those of the files; `settings` are what the scene says and defaults.
    pub(super) fn auto_fidelity(
        &self,
        body: &Mesh,
        obstacles: &[Option<Mesh>],
        settings: &Settings,
        hand: Option<&DeviceTrace>,
        motions: &[BuiltMotion],
    ) -> Option<AutoFidelity> {
        let spec = self.spec.fidelity?;
        let need = self.need(&spec, body, obstacles, settings, hand, motions);
        let method = &self.spec.method;
        let shapes = self.shapes();
        let fixed = Fixed {
            rate: spec.update_rate,
            gap_tolerance: method.gap_tolerance,
            rounds: method.implicit_rounds,
            mesh_errors: shapes.iter().map(|shape| simplify_of(shape)).collect(),
        };
        let chosen = decide(&need, &fixed, spec.budget_j, spec.time_us);
        let mut choices = method_choices(&need, &chosen, &fixed);
        let bodies = || std::iter::once(&need.body).chain(&need.obstacles);
        let mut mesh_errors = Vec::new();
        for ((body, error), fixed) in bodies().zip(&chosen.mesh_errors).zip(&fixed.mesh_errors) {
            if let Some(set) = fixed {
                choices.push(mesh_choice(body, *set, &need, true));
            } else if body.simplifiable {
                choices.push(mesh_choice(body, *error, &need, false));
            }
            mesh_errors.push(Some(*error).filter(|e| fixed.is_none() && *e > 0.0));
        }
        let shading = self.shading(&need, &chosen.mesh_errors, spec.budget_j, &mut choices);
        let (broadcast_rate, contacts) = published(&spec, &need, &mut choices);
        Some(AutoFidelity {
            gap_tolerance: chosen.gap_tolerance,
            rounds: chosen.rounds,
            mesh_errors,
            shading,
            plan: FidelityPlan {
                budget_j: spec.budget_j,
                time_us: spec.time_us,
                predicted_j: chosen.j,
                predicted_update_us: chosen.update_us,
                update_rate_hz: chosen.rate,
                broadcast_rate_hz: broadcast_rate,
                contacts,
                speed_m_s: need.speed,
                turn_rate_rad_s: need.turn_rate,
                choices,
            },
        })
    }

    /// For each obstacle, whether its facets would be felt and are to be shaded.
    fn shading(
        &self,
        need: &SceneNeed,
        mesh_errors: &[f64],
        budget_j: f64,
        choices: &mut Vec<Choice>,
    ) -> Vec<bool> {
        let mut shading = Vec::new();
        for (o, body) in self.spec.obstacles.iter().zip(&need.obstacles) {
            let error = mesh_errors[shading.len() + 1];
            let angle = body
                .facet_angle
                .max(crate::fidelity::errors::facet_angle(error, body.curvature));
            let felt = direction_jnd(0.5 * angle);
            let set = o.surface.shading.is_some();
            let wanted = body.shadable && !set && felt > budget_j;
            if set || body.shadable {
                let value = if set || wanted { "on" } else { "off" };
                choices.push(choice(
                    &format!("surface.shading of \"{}\"", o.name),
                    value.to_owned(),
                    set,
                    format!(
                        "its facets meet at {:.1} degrees, {felt:.2} J from the surface they stand for",
                        angle.to_degrees()
                    ),
                ));
            }
            shading.push(wanted);
        }
        shading
    }

    fn shapes(&self) -> Vec<&Shape> {
        let obstacles = self.spec.obstacles.iter().map(|o| &o.shape);
        std::iter::once(&self.spec.god_object.shape)
            .chain(obstacles)
            .collect()
    }

    fn need(
        &self,
        spec: &FidelitySpec,
        body: &Mesh,
        obstacles: &[Option<Mesh>],
        settings: &Settings,
        hand: Option<&DeviceTrace>,
        motions: &[BuiltMotion],
    ) -> SceneNeed {
        let held = &self.spec.god_object;
        let mass = match held.mass {
            MassSpec::Mass(mass) => mass,
            MassSpec::Density(density) => density * volume(body),
        };
        let [low, high] = body.bounding_box();
        let [speed, turn_rate] = hand.map_or([HAND_SPEED, HAND_TURN_RATE], |path| {
            fastest(path).map(|mean| PEAK * mean)
        });
        let mut needs = Vec::new();
        for (index, (o, mesh)) in self.spec.obstacles.iter().zip(obstacles).enumerate() {
            let Some(mesh) = mesh else { continue };
            let moves = motions.iter().find(|motion| motion.obstacle == index);
            let found = body_need(&o.name, &o.shape, mesh);
            needs.push(BodyNeed {
                // Texture coordinates hang on the vertices of the file.
                simplifiable: found.simplifiable && o.height_map.is_none(),
                shadable: found.facet_angle > 0.0,
                speed: moves.map_or(0.0, |motion| fastest(&motion.path)[0]),
                ..found
            });
        }
        let body_need = body_need(super::GOD_OBJECT_NAME, &held.shape, body);
        let sphere = matches!(held.shape.primitive(), Some(Primitive::Sphere { .. }));
        let centre = match held.reference_point {
            ReferencePoint::CenterOfMass => god_object::geometry::mass_properties(body).centroid,
            ReferencePoint::At(point) => point,
        };
        let off_centre = (centre - Point3::origin()).norm() > 1e-9;
        SceneNeed {
            body: body_need,
            obstacles: needs,
            size: (high - low).max(),
            lever: if sphere && !off_centre {
                0.0
            } else {
                body.radius_about(&centre)
            },
            stiffness: settings.stiffness(mass),
            k_s: settings.k_s,
            speed: spec.speed.unwrap_or(speed),
            turn_rate: spec.turn_rate.unwrap_or(turn_rate),
            force: spec.force.unwrap_or(JND_CHANGE / JND_MAGNITUDE),
            widest_tolerance: TOLERANCE_ROOM * (settings.rest_distance - settings.minimum_gap),
        }
    }
}

fn simplify_of(shape: &Shape) -> Option<f64> {
    match shape {
        Shape::Mesh { simplify, .. } => *simplify,
        _ => None,
    }
}

fn body_need(name: &str, shape: &Shape, mesh: &Mesh) -> BodyNeed {
    match shape.primitive() {
        Some(primitive) => BodyNeed::of_primitive(name, &primitive),
        None => BodyNeed {
            simplifiable: matches!(shape, Shape::Mesh { simplify: None, .. }),
            ..BodyNeed::of_mesh(name, mesh)
        },
    }
}

/// Highest mean speed, m/s, and turn rate, rad/s, between two poses. A hand peaks above it; an obstacle goes straight and evenly.
fn fastest(path: &DeviceTrace) -> [f64; 2] {
    let pairs = path.samples().windows(2);
    pairs.fold([0.0_f64, 0.0], |[speed, turn], pair| {
        let time = pair[1].time - pair[0].time;
        let way = pose_difference(&pair[1].pose, &pair[0].pose, &Vector3::zeros());
        [
            speed.max(linear(&way).norm() / time),
            turn.max(angular(&way).norm() / time),
        ]
    })
}

fn choice(key: &str, value: String, set: bool, reason: String) -> Choice {
    Choice {
        key: key.to_owned(),
        value,
        origin: if set { Origin::Set } else { Origin::Auto },
        reason,
    }
}

/// Rate and settings of the method, each with its share of the error.
fn method_choices(need: &SceneNeed, chosen: &Chosen, fixed: &Fixed) -> Vec<Choice> {
    let parts = Parts::of(
        need,
        chosen.rate,
        chosen.gap_tolerance,
        chosen.rounds,
        &chosen.mesh_errors,
    );
    vec![
        rate_choice(need, &parts, chosen.rate, fixed.rate.is_some()),
        choice(
            "method.gap_tolerance",
            format!("{:.1e} m", chosen.gap_tolerance),
            fixed.gap_tolerance.is_some(),
            format!(
                "{:.0} N/m make {:.4} J of it",
                need.stiffness, parts.tolerance
            ),
        ),
        choice(
            "method.implicit_rounds",
            chosen.rounds.to_string(),
            fixed.rounds.is_some(),
            format!(
                "points {:.1} mm from where the body turns, at {:.2} rad/s, leave their rows by {:.3} J",
                need.lever * 1e3,
                need.turn_rate,
                parts.linearisation
            ),
        ),
    ]
}

fn rate_choice(need: &SceneNeed, parts: &Parts, rate: f64, set: bool) -> Choice {
    let reason = format!(
        "normals turn by {:.1} per m at {:.3} m/s: {:.3} J of direction, {:.3} J off the tangent planes, {:.3} J of steps from set to set; {:.3} J of obstacles at {:.3} m/s",
        need.curvature(),
        need.speed,
        parts.direction,
        parts.sagitta,
        parts.step,
        parts.obstacles,
        need.obstacle_speed()
    );
    choice("fidelity.update_rate", format!("{rate} Hz"), set, reason)
}

fn mesh_choice(body: &BodyNeed, error: f64, need: &SceneNeed, set: bool) -> Choice {
    let value = if error > 0.0 {
        format!("{error:.1e} m")
    } else {
        "none".to_owned()
    };
    let reason = format!(
        "{} triangles, curvature {:.1} per m; an error of 10 um is {:.3} J",
        body.triangles,
        body.curvature,
        crate::fidelity::errors::force_jnd(need.stiffness * 1e-5, need.force)
    );
    choice(
        &format!("shape.simplify of \"{}\"", body.name),
        value,
        set,
        reason,
    )
}

/// States per second and contacts in each.
fn published(spec: &FidelitySpec, need: &SceneNeed, choices: &mut Vec<Choice>) -> (f64, u32) {
    let fastest = need.speed.max(need.obstacle_speed());
    let by_lag = (spec.budget_j * VISION_LAG).recip();
    let by_way = fastest / PIXEL;
    let [low, high] = BROADCAST_RATES;
    let rate = spec
        .broadcast_rate
        .unwrap_or_else(|| by_lag.max(by_way).ceil().clamp(low, high));
    choices.push(choice(
        "fidelity.broadcast_rate",
        format!("{rate} Hz"),
        spec.broadcast_rate.is_some(),
        format!(
            "vision may lag by 15 ms ({by_lag:.0} Hz for the budget's share), and {:.3} m/s pass a pixel of 1.5 mm {by_way:.0} times a second",
            fastest
        ),
    ));
    let shown: u32 = need
        .obstacles
        .iter()
        .map(|o| {
            if need.body.sharp || o.sharp {
                CONTACTS_SHARP
            } else {
                CONTACTS_SMOOTH
            }
        })
        .sum();
    let contacts = spec
        .contacts
        .unwrap_or_else(|| shown.min(taut_proto::state::MAX_CONTACTS as u32));
    choices.push(choice(
        "fidelity.contacts",
        contacts.to_string(),
        spec.contacts.is_some(),
        "one for a pair of smooth bodies, four where one has edges".to_owned(),
    ));
    (rate, contacts)
}
