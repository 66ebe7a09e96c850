//! Coupling → god-object loop: the acceleration constrained by the interpolated normals.
//!
//! * Writer: the coupling, when a contact is shaded; `None` otherwise.
//! * Reader: the god-object loop, which projects it on the true constraints.
//! * Stale: it carries the sequence number of its constraint set; the god-object loop does without one that belongs to another set.
//!
//! Source: Ortega et al. 2007, Section 6.1.3.

use god_object::surface::ShadedAcceleration;

use super::fanout::{Publisher, Subscriber, fanout};

/// The arrow back from the coupling.
pub fn channel() -> (
    Publisher<Option<ShadedAcceleration>>,
    Subscriber<Option<ShadedAcceleration>>,
) {
    let (publisher, [god_object]) = fanout(&None);
    (publisher, god_object)
}
