//! A scene's fidelity: what it needs, what is chosen, and the choice put into meshes, settings and surfaces.

use god_object::geometry::mass_properties;
use god_object::{ForceShading, Mesh, Settings, Surface};

use super::built::BuiltMotion;
use super::fidelity_choices::{choice, mesh_choice, method_choices, published};
use super::load::Scene;
use super::spec::{MassSpec, ReferencePoint, Shape};
use crate::fidelity::body::{CREASE, volume};
use crate::fidelity::errors::{JND_CHANGE, JND_MAGNITUDE, direction_jnd};
use crate::fidelity::met::{Met, Solid};
use crate::fidelity::need::{lever, rates, widest_tolerance};
use crate::fidelity::reach::Reach;
use crate::fidelity::{BodyNeed, Choice, FidelityPlan, FidelitySpec, Fixed, SceneNeed, decide};
use crate::trace::DeviceTrace;

/// Peak of a minimum-jerk motion over its mean speed: 15/8.
const PEAK: f64 = 1.875;
/// What a hand does whose path the scene does not say, m/s and rad/s.
const HAND_SPEED: f64 = 0.2;
const HAND_TURN_RATE: f64 = 1.0;
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
        let obstacles = self.spec.obstacles.iter().map(|o| &o.shape);
        let shapes = std::iter::once(&self.spec.god_object.shape).chain(obstacles);
        let fixed = Fixed {
            rate: spec.update_rate,
            gap_tolerance: method.gap_tolerance,
            rounds: method.implicit_rounds,
            mesh_errors: shapes.map(Shape::simplify).collect(),
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
        let stiffness = settings.stiffness(mass);
        let force = spec.force.unwrap_or(JND_CHANGE / JND_MAGNITUDE);
        let poses: Vec<_> = hand
            .map_or(&[][..], DeviceTrace::samples)
            .iter()
            .map(|sample| sample.pose)
            .collect();
        let reach = Reach::of(body, &poses, force / stiffness);
        let standing = self.spec.obstacles.iter().zip(obstacles);
        let standing: Vec<_> = standing
            .enumerate()
            .filter_map(|(index, (o, mesh))| Some((index, o, mesh.as_ref()?)))
            .collect();
        let motion_of = |index: usize| motions.iter().find(|motion| motion.obstacle == index);
        let solids = standing.iter().map(|(index, o, mesh)| {
            let moves = motion_of(*index).is_some();
            Solid::new(mesh, o.shape.primitive(), o.pose).that_moves(moves)
        });
        let solids: Vec<Solid<'_>> = solids.collect();
        let mut needs = Vec::new();
        for (own, (index, o, mesh)) in standing.into_iter().enumerate() {
            let moves = motion_of(index);
            // What moves may come to the hand anywhere.
            let reach = reach.filter(|_| moves.is_none());
            let found = body_need(&o.name, &o.shape, mesh, &Met::of(&solids, own, reach));
            needs.push(BodyNeed {
                // Texture coordinates hang on the vertices of the file.
                simplifiable: found.simplifiable && o.height_map.is_none(),
                shadable: found.facet_angle > 0.0,
                speed: moves.map_or(0.0, |motion| fastest(&motion.path)[0]),
                friction: o.surface.friction,
                ..found
            });
        }
        let centre = match held.reference_point {
            ReferencePoint::CenterOfMass => mass_properties(body).centroid,
            ReferencePoint::At(point) => point,
        };
        SceneNeed {
            body: body_need(super::GOD_OBJECT_NAME, &held.shape, body, &Met::default()),
            obstacles: needs,
            size: (high - low).max(),
            lever: lever(held.shape.primitive().as_ref(), body, &centre),
            stiffness,
            k_s: settings.k_s,
            speed: spec.speed.unwrap_or(speed),
            turn_rate: spec.turn_rate.unwrap_or(turn_rate),
            force,
            widest_tolerance: widest_tolerance(settings),
        }
    }
}

fn body_need(name: &str, shape: &Shape, mesh: &Mesh, met: &Met<'_>) -> BodyNeed {
    match shape.primitive() {
        Some(primitive) => BodyNeed::of_primitive(name, &primitive, mesh, met),
        None => BodyNeed {
            simplifiable: matches!(shape, Shape::Mesh { simplify: None, .. }),
            ..BodyNeed::of_mesh(name, mesh, met)
        },
    }
}

/// Highest mean speed, m/s, and turn rate, rad/s, between two poses. A hand peaks above it; an obstacle goes straight and evenly.
fn fastest(path: &DeviceTrace) -> [f64; 2] {
    let pairs = path.samples().windows(2);
    pairs.fold([0.0_f64, 0.0], |[speed, turn], pair| {
        let time = pair[1].time - pair[0].time;
        let [mean_speed, mean_turn] = rates([&pair[0].pose, &pair[1].pose], time);
        [speed.max(mean_speed), turn.max(mean_turn)]
    })
}
