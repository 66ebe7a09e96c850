//! What the monitor is told many times a second: one `Copy` value, no heap.

use nalgebra::{Point3, Vector3, Vector6};

use crate::scene::Pose;

/// Most obstacles whose places one sample carries.
pub const MAX_MOVING_OBSTACLES: usize = 12;
/// Most contacts that one sample carries; the others are counted, not drawn.
pub const MAX_SHOWN_CONTACTS: usize = 64;

/// The state of the three loops at one instant.
///
/// Times of loops are in microseconds because that is what the plots show; all else is SI.
#[derive(Clone, Copy, Debug)]
pub struct MonitorSample {
    /// Session time in nanoseconds since the server started.
    pub session_time_ns: u64,
    /// Pose of the god-object.
    pub god_object_pose: Pose,
    /// Where the obstacles that move are, at the same instant.
    pub moving: MovingObstacles,
    /// Pose of the device, possibly inside an obstacle.
    pub device_pose: Pose,
    /// Pose of the viewer's head, if it is tracked.
    pub head_pose: Option<Pose>,
    /// Wrench on the user's hand at the reference point: force (N) then torque (N m), world axes.
    pub wrench: Vector6<f64>,
    /// The contacts to draw.
    pub contacts: ShownContacts,
    /// Smallest gap between god-object and obstacles, metres; NaN when not known.
    pub gap_min: f64,
    /// Age of the constraint set that the force was computed from, microseconds.
    pub constraint_age_us: f32,
    /// Haptics loop (device rate): its period.
    pub haptics_period: LoopTime,
    /// God-object simulation: time of one update.
    pub god_object_update: LoopTime,
    /// Constraint-based coupling: time of one force.
    pub force_update: LoopTime,
    /// Pose datagrams sent since the start, all clients together.
    pub packets_sent: u64,
    /// Datagrams received and accepted since the start.
    pub packets_received: u64,
    /// Connected clients.
    pub clients: u32,
    /// Poses found to intersect an obstacle since the start; anything but 0 is a fault.
    pub penetrations: u64,
    /// What lay between this sample and the one before.
    pub between: Envelope,
}

impl MonitorSample {
    /// A sample at this time with both poses at the origin, no force and no contact.
    #[must_use]
    pub fn at(session_time_ns: u64) -> MonitorSample {
        MonitorSample {
            session_time_ns,
            god_object_pose: Pose::identity(),
            moving: MovingObstacles::default(),
            device_pose: Pose::identity(),
            head_pose: None,
            wrench: Vector6::zeros(),
            contacts: ShownContacts::default(),
            gap_min: f64::NAN,
            constraint_age_us: 0.0,
            haptics_period: LoopTime::default(),
            god_object_update: LoopTime::default(),
            force_update: LoopTime::default(),
            packets_sent: 0,
            packets_received: 0,
            clients: 0,
            penetrations: 0,
            between: Envelope::default(),
        }
    }
}

/// Least and largest of what was between two samples: nothing where nothing was added.
#[derive(Clone, Copy, Debug)]
pub struct Envelope {
    felt: [(f64, f64); 8],
    oldest_constraints_us: f32,
}

impl Envelope {
    /// Adds a tick: the wrench on the hand (N, N m) and the age of its constraints. No allocation; NaN adds nothing.
    pub fn add(&mut self, wrench: &Vector6<f64>, constraint_age_us: f32) {
        for (value, (least, largest)) in felt(wrench).into_iter().zip(&mut self.felt) {
            (*least, *largest) = (least.min(value), largest.max(value));
        }
        self.oldest_constraints_us = self.oldest_constraints_us.max(constraint_age_us);
    }

    pub(crate) fn join(&mut self, other: &Self) {
        for ((least, largest), more) in self.felt.iter_mut().zip(&other.felt) {
            (*least, *largest) = (least.min(more.0), largest.max(more.1));
        }
        self.oldest_constraints_us = self.oldest_constraints_us.max(other.oldest_constraints_us);
    }

    /// Least and largest of a force's (0) or a torque's (1) components and norm, with `newest` among them.
    pub(crate) fn of(&self, which: usize) -> &[(f64, f64)] {
        &self.felt[4 * which..4 * which + 4]
    }

    pub(crate) fn oldest_constraints_us(&self) -> f32 {
        self.oldest_constraints_us
    }
}

impl Default for Envelope {
    fn default() -> Envelope {
        Envelope {
            felt: [(f64::INFINITY, f64::NEG_INFINITY); 8],
            oldest_constraints_us: 0.0,
        }
    }
}

/// Components and norm of the force, then of the torque.
pub(crate) fn felt(wrench: &Vector6<f64>) -> [f64; 8] {
    let force = wrench.fixed_rows::<3>(0);
    let torque = wrench.fixed_rows::<3>(3);
    [
        force[0],
        force[1],
        force[2],
        force.norm(),
        torque[0],
        torque[1],
        torque[2],
        torque.norm(),
    ]
}

/// A loop's time: the newest and the 99th percentile over the loop's recent past.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoopTime {
    /// The newest value, microseconds.
    pub last_us: f32,
    /// 99th percentile, microseconds.
    pub p99_us: f32,
    /// The longest since the sample before, microseconds.
    pub longest_us: f32,
}

/// Places of up to [`MAX_MOVING_OBSTACLES`] obstacles.
#[derive(Clone, Copy, Debug)]
pub struct MovingObstacles {
    places: [(u16, Pose); MAX_MOVING_OBSTACLES],
    count: usize,
}

impl MovingObstacles {
    /// Adds an obstacle by its index among the scene's obstacles. False where there is no room. No allocation.
    pub fn push(&mut self, obstacle: u16, world_from_obstacle: Pose) -> bool {
        let Some(place) = self.places.get_mut(self.count) else {
            return false;
        };
        *place = (obstacle, world_from_obstacle);
        self.count += 1;
        true
    }

    /// Index among the scene's obstacles and pose, each.
    #[must_use]
    pub fn as_slice(&self) -> &[(u16, Pose)] {
        &self.places[..self.count]
    }
}

impl Default for MovingObstacles {
    fn default() -> MovingObstacles {
        MovingObstacles {
            places: [(0, Pose::identity()); MAX_MOVING_OBSTACLES],
            count: 0,
        }
    }
}

/// One contact as it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownContact {
    /// Point on the obstacle, world axes, metres.
    pub point: Point3<f64>,
    /// Unit normal, obstacle → god-object, world axes.
    pub normal: Vector3<f64>,
}

/// Up to [`MAX_SHOWN_CONTACTS`] contacts, and how many there were.
#[derive(Clone, Copy, Debug)]
pub struct ShownContacts {
    shown: [ShownContact; MAX_SHOWN_CONTACTS],
    total: u32,
}

impl ShownContacts {
    /// Adds a contact; beyond [`MAX_SHOWN_CONTACTS`] it is only counted. No allocation.
    pub fn push(&mut self, contact: ShownContact) {
        if let Some(slot) = self.shown.get_mut(self.total as usize) {
            *slot = contact;
        }
        self.total = self.total.saturating_add(1);
    }

    /// The contacts to draw.
    #[must_use]
    pub fn as_slice(&self) -> &[ShownContact] {
        &self.shown[..(self.total as usize).min(MAX_SHOWN_CONTACTS)]
    }

    /// How many contacts there were, drawn or not.
    #[must_use]
    pub fn total(&self) -> u32 {
        self.total
    }
}

impl Default for ShownContacts {
    fn default() -> ShownContacts {
        let none = ShownContact {
            point: Point3::origin(),
            normal: Vector3::zeros(),
        };
        ShownContacts {
            shown: [none; MAX_SHOWN_CONTACTS],
            total: 0,
        }
    }
}

impl FromIterator<ShownContact> for ShownContacts {
    fn from_iter<I: IntoIterator<Item = ShownContact>>(contacts: I) -> ShownContacts {
        let mut shown = ShownContacts::default();
        for contact in contacts {
            shown.push(contact);
        }
        shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contacts_beyond_the_capacity_are_counted_but_not_kept() {
        let extra = 3;
        let contacts: ShownContacts = (0..MAX_SHOWN_CONTACTS + extra)
            .map(|i| ShownContact {
                point: Point3::new(i as f64, 0.0, 0.0),
                normal: Vector3::z(),
            })
            .collect();
        assert_eq!(contacts.as_slice().len(), MAX_SHOWN_CONTACTS);
        assert_eq!(contacts.total() as usize, MAX_SHOWN_CONTACTS + extra);
        let last = contacts.as_slice()[MAX_SHOWN_CONTACTS - 1];
        assert_eq!(last.point.x, (MAX_SHOWN_CONTACTS - 1) as f64);
    }
}
