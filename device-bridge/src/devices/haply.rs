//! A Haply Inverse arm, with or without a VerseGrip: three degrees of freedom of force, six (or three) of motion.
//!
//! The cursor is the reference point of the body ([`ArmDevice`]). The arm's axes: x right, y away from the user, z up (the service's basis XYZ), origin at its
//! base.
//!
//! Force limit, damping, mass and axes are assumed: no device was at hand, and the vendor publishes none of them with its protocol.

use nalgebra::{Matrix6, Vector3};
use taut_plant::Grip;
use taut_vrpn::SensorMapping;

use crate::choice::ForceDevice;
use crate::devices::arm::{ArmDevice, ArmPort, ArmSettings};
use crate::devices::wire_thread::ArmThread;
use crate::devices::{Anchor, ArmState, arm_limits};
use crate::haply::{
    self, EVENTS_PORT, ExchangeSettings, HaplyError, ServiceAddress, WORKSPACE_CENTRE,
};
use crate::own_thread::OwnThread;
use crate::placement::Placement;

/// The arm's mechanics as they are assumed: to be measured on a real one.
pub(crate) fn haply_grip() -> Grip {
    Grip {
        mass: 0.1,                                 // kg
        damping: Vector3::repeat(1.0),             // N s/m
        rotational_inertia: 2e-5,                  // kg m^2
        rotational_damping: Vector3::repeat(1e-4), // N m s/rad
        coulomb_force: Vector3::zeros(),
        coulomb_torque: Vector3::zeros(),
        string_inertia: Matrix6::zeros(),
        max_force: 5.0, // N
        max_torque: 0.0,
    }
}

/// An arm as a device.
#[derive(Clone, Debug, PartialEq)]
pub struct HaplySettings {
    /// Of the service.
    pub address: ServiceAddress,
    /// Which arm, which grip.
    pub exchange: ExchangeSettings,
    /// From the arm's frame to the workbench's.
    pub mapping: SensorMapping,
    /// How the body follows.
    pub anchor: Anchor,
    /// Where the service tells its events; `None` does not listen.
    pub events_port: Option<u16>,
}

/// The client, and who listens beside it: dropped in this order, so that the force goes first.
struct Connected {
    client: ArmThread,
    _events: Option<OwnThread>,
}

impl HaplySettings {
    /// The arm as a device.
    #[must_use]
    pub fn arm(&self) -> ArmSettings {
        ArmSettings {
            name: format!("Haply Inverse at {}", self.address),
            limits: arm_limits(&haply_grip(), f64::INFINITY),
            with_orientation: self.exchange.with_grip,
            centre: WORKSPACE_CENTRE.into(),
            mapping: self.mapping,
            anchor: self.anchor,
        }
    }

    /// Connects to the service.
    ///
    /// # Errors
    /// [`HaplyError`]: it is not there, or too old. An arm that is not there yet is waited for.
    pub fn open(&self, placement: Placement, priority: u8) -> Result<ArmDevice, HaplyError> {
        let client = haply::start(self.address.clone(), self.exchange.clone(), priority)?;
        let events = self.events_port.map(|port| {
            // Without the thread nothing is told, and all else goes on.
            haply::listen(&self.address.host, port).ok()
        });
        let port = Connected {
            client,
            _events: events.flatten(),
        };
        Ok(ArmDevice::new(Box::new(port), self.arm(), placement))
    }

    /// What the arm is assumed to bear.
    #[must_use]
    pub fn force_device(&self) -> ForceDevice {
        ForceDevice::arm(haply_grip(), &self.mapping)
    }
}

impl Default for HaplySettings {
    fn default() -> Self {
        Self {
            address: ServiceAddress::default(),
            exchange: ExchangeSettings::default(),
            mapping: SensorMapping::identity(),
            anchor: Anchor::default(),
            events_port: Some(EVENTS_PORT),
        }
    }
}

impl ArmPort for Connected {
    fn newest(&mut self) -> ArmState {
        *self.client.newest()
    }

    fn push(&mut self, force: [f64; 3]) {
        self.client.command(force);
    }

    fn let_go(&mut self) -> bool {
        self.client.let_go()
    }
}
