//! What of a scene decides how much fidelity it needs.

use god_object::spatial::{angular, linear, pose_difference};
use god_object::{Mesh, Pose, Primitive, Settings, World};
use nalgebra::{Point3, Vector3};

use super::body::BodyNeed;
use super::contact::{Contact, Late};
use super::met::{Met, Solid};
use super::reach::Reach;

/// Share of the room between minimum gap and rest distance that the tolerance may fill.
const TOLERANCE_ROOM: f64 = 0.9;

/// How a scene is used, as far as it decides.
#[derive(Clone, Debug, PartialEq)]
pub struct Usage {
    /// Fastest that the hand goes, m/s.
    pub speed: f64,
    /// Fastest that it turns, rad/s.
    pub turn_rate: f64,
    /// A usual force of contact, N.
    pub force: f64,
    /// Where the hand goes, straight from pose to pose; empty where that is not known.
    pub path: Vec<Pose>,
    /// How fast each obstacle moves, m/s; what is not there stands still.
    pub obstacle_speeds: Vec<f64>,
}

/// All that decides.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneNeed {
    /// The god-object.
    pub body: BodyNeed,
    /// The rest.
    pub obstacles: Vec<BodyNeed>,
    /// Longest side of the god-object, m.
    pub size: f64,
    /// Distance of the god-object's farthest point from where it turns, m; 0 where turning does not move its surface.
    pub lever: f64,
    /// Translational stiffness, N/m.
    pub stiffness: f64,
    /// Share of the pose difference that one update covers.
    pub k_s: f64,
    /// Fastest that the hand goes, m/s.
    pub speed: f64,
    /// Fastest that it turns, rad/s.
    pub turn_rate: f64,
    /// A usual force of contact, N.
    pub force: f64,
    /// Largest gap tolerance for which the settings are in order, m.
    pub widest_tolerance: f64,
}

impl SceneNeed {
    /// Of bodies that are ready, held by these settings.
    #[must_use]
    pub fn of_world(world: &World, settings: &Settings, usage: &Usage) -> Self {
        let held = &world.body;
        let stiffness = settings.stiffness(held.mass);
        let reach = Reach::of(&held.mesh, &usage.path, usage.force / stiffness);
        let speed_of = |index: usize| usage.obstacle_speeds.get(index).copied().unwrap_or(0.0);
        let solids = world.obstacles.iter().enumerate().map(|(index, o)| {
            Solid::new(&o.mesh, o.primitive, o.pose).that_moves(speed_of(index) > 0.0)
        });
        let solids: Vec<Solid<'_>> = solids.collect();
        let obstacles = world.obstacles.iter().enumerate().map(|(index, o)| {
            let speed = speed_of(index);
            // What moves may come to the hand anywhere.
            let reach = reach.filter(|_| speed == 0.0);
            let met = Met::of(&solids, index, reach);
            let found = match &o.primitive {
                Some(primitive) => BodyNeed::of_primitive(&o.name, primitive, &o.mesh, &met),
                None => BodyNeed::of_mesh(&o.name, &o.mesh, &met),
            };
            BodyNeed {
                speed,
                friction: o.surface.friction,
                ..found
            }
        });
        let body = match &held.primitive {
            Some(primitive) => {
                BodyNeed::of_primitive("god-object", primitive, &held.mesh, &Met::default())
            }
            None => BodyNeed::of_mesh("god-object", &held.mesh, &Met::default()),
        };
        let [low, high] = held.mesh.bounding_box();
        Self {
            obstacles: obstacles.collect(),
            body,
            size: (high - low).max(),
            lever: lever(held.primitive.as_ref(), &held.mesh, &held.reference_point),
            stiffness,
            k_s: settings.k_s,
            speed: usage.speed,
            turn_rate: usage.turn_rate,
            force: usage.force,
            widest_tolerance: widest_tolerance(settings),
        }
    }

    /// How deep the device goes with the usual force, m.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.force / self.stiffness
    }

    /// How fast a contact's normal turns along the way at most, 1/m.
    #[must_use]
    pub fn curvature(&self) -> f64 {
        let contacts = self.contacts(&[]);
        contacts.fold(0.0, |most, contact| most.max(contact.curvature()))
    }

    /// What late sets make of the contacts, the worst of each, with meshes that are so far off their files,
    /// m, god-object first.
    #[must_use]
    pub fn late(&self, rate: f64, rounds: u32, mesh_errors: &[f64]) -> Late {
        let contacts = self.contacts(mesh_errors);
        contacts.fold(Late::default(), |most, contact| {
            most.or_more(contact.late(rate, rounds))
        })
    }

    /// The fastest obstacle, m/s.
    #[must_use]
    pub fn obstacle_speed(&self) -> f64 {
        self.obstacles.iter().fold(0.0, |v, o| v.max(o.speed))
    }

    fn contacts(&self, mesh_errors: &[f64]) -> impl Iterator<Item = Contact<'_>> {
        let error = move |index: usize| mesh_errors.get(index).copied().unwrap_or(0.0);
        let of_body = error(0);
        self.obstacles
            .iter()
            .enumerate()
            .map(move |(index, o)| Contact {
                need: self,
                obstacle: o,
                errors: [of_body, error(index + 1)],
            })
    }
}

/// Distance of a body's farthest point from where it turns, m; 0 of a sphere about its middle.
pub(crate) fn lever(primitive: Option<&Primitive>, mesh: &Mesh, turns_about: &Point3<f64>) -> f64 {
    match primitive {
        Some(Primitive::Sphere { center, .. }) if (center - turns_about).norm() <= 1e-9 => 0.0,
        _ => mesh.radius_about(turns_about),
    }
}

/// Largest gap tolerance for which the settings are in order, m.
pub(crate) fn widest_tolerance(settings: &Settings) -> f64 {
    TOLERANCE_ROOM * (settings.rest_distance - settings.minimum_gap)
}

/// Speed, m/s, and turn rate, rad/s, from one pose to another.
#[must_use]
pub fn rates([from, to]: [&Pose; 2], time: f64) -> [f64; 2] {
    let way = pose_difference(to, from, &Vector3::zeros());
    [linear(&way).norm() / time, angular(&way).norm() / time]
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::nalgebra::UnitQuaternion;

    #[test]
    fn rates_are_ways_over_time() {
        let turned = UnitQuaternion::new(Vector3::z() * 0.3);
        let to = Pose::from_parts(Vector3::new(0.0, 0.02, 0.0).into(), turned);
        let [speed, turn] = rates([&Pose::identity(), &to], 0.1);
        assert!((speed - 0.2).abs() < 1e-12 && (turn - 3.0).abs() < 1e-9);
    }
}
