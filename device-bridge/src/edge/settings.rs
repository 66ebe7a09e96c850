//! The method's settings to the wire and back, whole.

use god_object::{Adaptation, RotationMetric, Settings, SolverKind};
use taut_link::proto::constraints::MAX_SET_ROWS;
use taut_link::proto::coupling::{EdgeAdaptation, EdgeSettings};

use super::offer::OfferError;

/// Why settings cannot be used at the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum NotAtEdge {
    #[error("its constraint sets may have more rows than travel ({MAX_SET_ROWS})")]
    TooManyRows,
    #[error("its solver takes memory, which a device's loop may not")]
    Solver,
}

/// `$source`, a `$Source`, as a `$Target`: the fields named here are the same on both sides, those in braces differ.
///
/// The pattern and the value are whole: a field that is added to either side does not compile until it is sent.
macro_rules! converted {
    ($source:expr, $Source:ident { $($differs:ident $(: $ignored:tt)?),* } => $Target:ident { $($field:ident: $value:expr),* $(,)? }) => {
        converted!(@ $source, $Source { $($differs $(: $ignored)?),* } => $Target { $($field: $value),* };
            k_s k_h damping_time look_ahead passive force_limit torque_limit rest_distance minimum_gap gap_tolerance
            activation_distance look_ahead_limit look_ahead_pairs motion_tolerance max_substeps implicit_rounds
            max_advancement_steps work_budget)
    };
    (@ $source:expr, $Source:ident { $($differs:ident $(: $ignored:tt)?),* } => $Target:ident { $($field:ident: $value:expr),* }; $($same:ident)*) => {{
        let $Source { $($differs $(: $ignored)?,)* $($same),* } = $source;
        $Target { $($field: $value,)* $($same),* }
    }};
}

/// The settings in the form in which they travel.
pub(super) fn to_wire(settings: &Settings) -> Result<EdgeSettings, NotAtEdge> {
    if settings.max_constraints > MAX_SET_ROWS {
        return Err(NotAtEdge::TooManyRows);
    }
    if settings.solver != SolverKind::ActiveSet {
        return Err(NotAtEdge::Solver); // the others allocate
    }
    Ok(converted!(
        *settings,
        Settings { rotation_metric, adaptation, max_constraints, solver: _ } => EdgeSettings {
            radius_of_gyration: match rotation_metric {
                RotationMetric::Inertia => None,
                RotationMetric::RadiusOfGyration(radius) => Some(radius),
            },
            adaptation: adaptation.map(|Adaptation { duration, threshold }| EdgeAdaptation { duration, threshold }),
            max_constraints: max_constraints as u32, // at most MAX_SET_ROWS
        }
    ))
}

/// The settings that travelled.
///
/// # Errors
/// [`OfferError`]: one is out of its range.
pub(super) fn from_wire(wire: &EdgeSettings) -> Result<Settings, OfferError> {
    if wire.max_constraints as usize > MAX_SET_ROWS {
        return Err(OfferError::Invalid("a number of rows"));
    }
    let settings = converted!(
        *wire,
        EdgeSettings { radius_of_gyration, adaptation, max_constraints } => Settings {
            rotation_metric: radius_of_gyration.map_or(RotationMetric::Inertia, RotationMetric::RadiusOfGyration),
            adaptation: adaptation.map(|EdgeAdaptation { duration, threshold }| Adaptation { duration, threshold }),
            max_constraints: max_constraints as usize,
            solver: SolverKind::ActiveSet,
        }
    );
    settings.validate()?;
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_link::proto::control::{ControlMessage, LENGTH_BYTES};
    use taut_link::proto::{CouplingOffer, EdgeCoupling};

    /// Every field differs from the default of every size.
    fn unusual() -> Settings {
        let usual = Settings::for_size(0.1);
        let settings = Settings {
            k_s: 0.7,
            k_h: 1500.0,
            damping_time: 0.015,
            rotation_metric: RotationMetric::RadiusOfGyration(0.03),
            adaptation: Some(Adaptation {
                duration: 0.03,
                threshold: -3e-3,
            }),
            look_ahead: !usual.look_ahead,
            passive: !usual.passive,
            force_limit: 15.0,
            torque_limit: 0.4,
            rest_distance: 1.1e-5,
            minimum_gap: 1.2e-6,
            gap_tolerance: 1.3e-7,
            activation_distance: 4.4e-4,
            look_ahead_limit: 0.6,
            look_ahead_pairs: 777,
            motion_tolerance: 6e-8,
            max_constraints: 512,
            max_substeps: 7,
            implicit_rounds: 2,
            max_advancement_steps: 123,
            work_budget: Some(45),
            solver: SolverKind::ActiveSet,
        };
        // `Debug` prints a field a line: none is as usual, but for the one solver that an edge has.
        let (these, those) = (format!("{settings:#?}"), format!("{usual:#?}"));
        let same = |line: &&str| line.ends_with(',') && those.lines().any(|other| other == *line);
        let same = |line: &&str| same(line) && line.contains(": ") && !line.contains("solver: ");
        assert_eq!(these.lines().find(same), None);
        settings
    }

    /// The bytes of the control stream and back.
    fn through_the_wire(offer: EdgeCoupling) -> EdgeCoupling {
        let message = ControlMessage::Coupling(CouplingOffer::AtEdge(offer));
        let frame = message.to_frame().expect("an encoding");
        match ControlMessage::from_frame_body(&frame[LENGTH_BYTES..]) {
            Ok(ControlMessage::Coupling(CouplingOffer::AtEdge(offer))) => offer,
            other => panic!("{other:?}"),
        }
    }

    fn offer(settings: EdgeSettings) -> EdgeCoupling {
        EdgeCoupling {
            settings,
            ..crate::edge::offer()
        }
    }

    #[test]
    fn default_settings_travel_for_every_size_of_body() {
        for size in [1e-6, 1e-3, 0.1, 1e3, 1e5] {
            let settings = Settings::for_size(size);
            let wire = to_wire(&settings).expect("at the edge");
            let back = from_wire(&through_the_wire(offer(wire)).settings).expect("in range");
            assert_eq!(back, settings, "{size} m");
        }
    }

    #[test]
    fn every_setting_comes_through_the_wire() {
        let plain = Settings {
            rotation_metric: RotationMetric::Inertia,
            adaptation: None,
            work_budget: None,
            ..unusual()
        };
        for settings in [unusual(), plain, Settings::for_size(0.02)] {
            let sent = offer(to_wire(&settings).expect("for the edge"));
            let came = through_the_wire(sent);
            assert_eq!(from_wire(&came.settings), Ok(settings));
        }
    }

    #[test]
    fn what_no_edge_can_use_is_not_sent_and_not_taken() {
        let many = Settings {
            max_constraints: MAX_SET_ROWS + 1,
            ..unusual()
        };
        assert_eq!(to_wire(&many), Err(NotAtEdge::TooManyRows));
        let slow = Settings {
            solver: SolverKind::Clarabel,
            ..unusual()
        };
        assert_eq!(to_wire(&slow), Err(NotAtEdge::Solver));
        let good = to_wire(&unusual()).expect("for the edge");
        let refused = |settings: EdgeSettings| from_wire(&settings).is_err();
        assert!(refused(EdgeSettings {
            max_constraints: MAX_SET_ROWS as u32 + 1,
            ..good
        }));
        assert!(refused(EdgeSettings {
            damping_time: f64::NAN,
            ..good
        }));
        assert!(refused(EdgeSettings {
            implicit_rounds: 4,
            ..good
        }));
    }
}
