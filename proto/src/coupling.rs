//! What a device bridge needs in order to couple by itself: told once, at join, on the control stream.
//!
//! The bridge gets no geometry: mass properties, constants and the surfaces of the obstacles are all that the coupling asks of a world. Constraint
//! sets follow as datagrams, see [`crate::constraints`].
//!
//! Each number has a range of its own here; how they fit together (gaps in order, a tensor that is one) is checked where they become the method's.

use crate::{
    DecodeError, EncodeError, PoseF64, Untrusted,
    codec::{Reader, Wire, Writer, wire_struct},
    range::{
        CAPACITY, COUNT, DEPTH, EXTENT, FRICTION, GAIN, INERTIA, LASTS, LENGTH, MASS, ROUNDS,
        SET_RATE, SIZE, SLOPE, STEPS, STIFFNESS, STRENGTH, UNIT,
    },
};

/// Where a device's force may be computed.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "made once per session, never moved in a loop"
)]
pub enum CouplingOffer {
    /// At the server alone.
    AtServer {
        /// Why: one sentence, for people.
        reason: Untrusted,
    },
    /// Beside the device, too.
    AtEdge(EdgeCoupling),
}

wire_struct! {
    /// All that the coupling needs besides constraint sets.
    #[derive(Clone, Debug, PartialEq)]
    pub struct EdgeCoupling {
        /// Mass of the god-object's body, kg.
        pub mass: f64 => MASS,
        /// Inertia tensor about the reference point, body axes, row by row, kg m².
        pub inertia: [f64; 9] => INERTIA,
        /// The point at which motion is split and wrenches act, body frame, m.
        pub reference_point: [f64; 3] => LENGTH,
        /// Distance of the body's farthest point from it, m.
        pub radius: f64 => EXTENT,
        /// The settings of the method, all of them.
        pub settings: EdgeSettings,
        /// Constraint sets per second.
        pub set_rate_hz: f64 => SET_RATE,
        /// The obstacles, in the scene's order.
        pub obstacles: Vec<EdgeSurface>,
    }
}

wire_struct! {
    /// The settings of the method as the server uses them, whole: the bridge computes with the same, whatever of them a coupling looks at.
    ///
    /// One field for each of the method's settings, in its order; what it means is said there.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct EdgeSettings {
        /// Share of the pose difference that one update covers.
        pub k_s: f64 => GAIN,
        /// Coupling constant, 1/s².
        pub k_h: f64 => STIFFNESS,
        /// Damping of a contact over its stiffness, s.
        pub damping_time: f64 => LASTS,
        /// Radius of gyration that stands for the inertia tensor in the metric, m; `None`: the tensor.
        pub radius_of_gyration: Option<f64> => EXTENT,
        /// How a violated new row enters; `None`: at once.
        pub adaptation: Option<EdgeAdaptation>,
        /// Rows act before they touch.
        pub look_ahead: bool,
        /// The energy given is bounded by the energy taken.
        pub passive: bool,
        /// Largest force, N.
        pub force_limit: f64 => STRENGTH,
        /// Largest torque, N m.
        pub torque_limit: f64 => STRENGTH,
        /// Gap at which the god-object rests, m.
        pub rest_distance: f64 => SIZE,
        /// Gap below which it never comes, m.
        pub minimum_gap: f64 => SIZE,
        /// How far above that gap collision detection may stop, m.
        pub gap_tolerance: f64 => SIZE,
        /// Feature pairs nearer than this make rows, m.
        pub activation_distance: f64 => SIZE,
        /// Most that look-ahead adds to that distance, m.
        pub look_ahead_limit: f64 => SIZE,
        /// Pairs that one collection may look at.
        pub look_ahead_pairs: u64 => COUNT,
        /// A motion whose fastest point covers less is none, m.
        pub motion_tolerance: f64 => SIZE,
        /// Most rows of a set.
        pub max_constraints: u32 => CAPACITY,
        /// Most repetitions within one update.
        pub max_substeps: u32 => STEPS,
        /// How often rows are linearised anew for one force.
        pub implicit_rounds: u32 => ROUNDS,
        /// Most evaluations of one feature pair's gap.
        pub max_advancement_steps: u32 => STEPS,
        /// Work after which an update starts no further sub-step, us; `None` is no budget.
        pub work_budget: Option<u64> => COUNT,
    }
}

wire_struct! {
    /// How a violated new row enters.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct EdgeAdaptation {
        /// Time that its bound takes to rise, s.
        pub duration: f64 => LASTS,
        /// Negative, m: smaller violations enter at once.
        pub threshold: f64 => DEPTH,
    }
}

wire_struct! {
    /// How an obstacle feels.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct EdgeSurface {
        /// Scene from obstacle.
        pub pose: PoseF64,
        /// Coefficient of friction; 0 is none.
        pub friction: f64 => FRICTION,
        /// A sine that tilts the force.
        pub sine: Option<EdgeSine>,
    }
}

wire_struct! {
    /// A sine along one axis that tilts the force.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct EdgeSine {
        /// Unit vector, obstacle frame.
        pub axis: [f64; 3] => UNIT,
        /// m.
        pub wavelength: f64 => EXTENT,
        /// Largest tilt, as the tangent of the angle.
        pub amplitude: f64 => SLOPE,
    }
}

impl Wire for CouplingOffer {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        match self {
            CouplingOffer::AtServer { reason } => {
                0_u8.write(to)?;
                reason.write(to)
            }
            CouplingOffer::AtEdge(coupling) => {
                1_u8.write(to)?;
                coupling.write(to)
            }
        }
    }

    fn read(from: &mut Reader<'_>) -> Result<CouplingOffer, DecodeError> {
        match u8::read(from)? {
            0 => Ok(CouplingOffer::AtServer {
                reason: Wire::read(from)?,
            }),
            1 => Ok(CouplingOffer::AtEdge(Wire::read(from)?)),
            tag => Err(DecodeError::UnknownTag {
                what: "coupling",
                tag,
            }),
        }
    }
}
