//! What is swept: the conditions of each map.

use super::contact::Contact;

/// Coulomb friction where a count is swept, N: without it no count is passive.
const COULOMB: f64 = 0.02;

/// What is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conditions {
    /// What holds the ball or the peg.
    pub(crate) contact: Contact,
    /// t_d, s.
    pub(crate) delay: f64,
    /// f, Hz.
    pub(crate) updates: u32,
    /// Share of the way to the device that a god-object covers in an update, where it is not the method's
    /// own.
    pub(crate) k_s: Option<f64>,
    /// b, N s/m.
    pub(crate) damping: f64,
    /// f_c, N.
    pub(crate) coulomb: f64,
    /// Delta, m; 0 is none.
    pub(crate) resolution: f64,
}

pub(super) const STANDARD: Conditions = Conditions {
    contact: Contact::Wall,
    delay: 1e-3,
    updates: 1000,
    k_s: None,
    damping: 1.0,
    coulomb: 0.0,
    resolution: 0.0,
};

/// In a contact, with so many updates, Hz.
pub(super) fn updated(contact: Contact, hz: f64) -> Conditions {
    Conditions {
        contact,
        updates: hz as u32,
        ..STANDARD
    }
}

/// One map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Map {
    /// Name in files.
    pub(crate) name: &'static str,
    /// What is swept, with its unit.
    pub(crate) axis: &'static str,
    /// Where.
    pub(super) values: &'static [f64],
    pub(super) at: fn(f64) -> Conditions,
}

/// Updates, Hz.
const RATES: [f64; 5] = [70.0, 140.0, 300.0, 500.0, 1000.0];

/// All.
pub(crate) const MAPS: [Map; 9] = [
    Map {
        name: "delay",
        axis: "delay of the force, ms",
        values: &[0.25, 0.5, 1.0, 2.0, 4.0, 8.0],
        at: |ms| Conditions {
            delay: ms * 1e-3,
            ..STANDARD
        },
    },
    Map {
        name: "rate",
        axis: "updates of the method, Hz (forces 1 kHz)",
        values: &RATES,
        at: |hz| updated(Contact::Wall, hz),
    },
    Map {
        name: "corner",
        axis: "updates of the method in a corner of two walls, Hz",
        values: &RATES,
        at: |hz| updated(Contact::Corner, hz),
    },
    Map {
        name: "turning",
        axis: "updates of the method in a hollow, where the contact turns, Hz",
        values: &RATES,
        at: |hz| updated(Contact::Hollow, hz),
    },
    Map {
        name: "turning-mesh",
        axis: "updates of the method, Hz, for a ball of 320 triangles in that hollow",
        values: &RATES,
        at: |hz| updated(Contact::MeshInHollow, hz),
    },
    Map {
        name: "hole",
        axis: "updates of the method, Hz, for a peg in its hole",
        values: &RATES,
        at: |hz| updated(Contact::PegInHole, hz),
    },
    Map {
        name: "way",
        axis: "share k_s of the way that an update covers, in a hollow at 300 Hz",
        values: &[0.25, 0.5, 0.75, 1.0],
        at: |k_s| Conditions {
            k_s: Some(k_s),
            ..updated(Contact::Hollow, 300.0)
        },
    },
    Map {
        name: "damping",
        axis: "damping of the device, N s/m",
        values: &[0.2, 0.5, 1.0, 2.0, 5.0, 10.0],
        at: |damping| Conditions {
            damping,
            ..STANDARD
        },
    },
    Map {
        name: "quantisation",
        axis: "a count of the encoder, um (friction 0.02 N)",
        values: &[1.0, 5.0, 29.24, 100.0, 300.0],
        at: |um| Conditions {
            coulomb: COULOMB,
            resolution: um * 1e-6,
            ..STANDARD
        },
    },
];
