//! The page's port and its desk, which outlive a session that makes way for another: whoever is there stays, and his token counts.

use std::sync::Arc;

use taut_bridge::ArmSwitch;
use taut_observers::{OperatorServer, OperatorSettings, fresh_token};

use super::desk::OperatorDesk;
use super::scene_desk::SceneDesk;
use super::settings::OperatorSetup;
use crate::session::handover::Handover;
use crate::shared::failure::Failure;

/// What the sessions of one process have in common.
#[derive(Default)]
pub(crate) struct Continuity {
    /// Asks for force at the device, or for none.
    pub(crate) switch: Arc<ArmSwitch>,
    /// Where the scene is changed.
    pub(crate) scenes: Arc<SceneDesk>,
    /// What the session before left to one of the same scene.
    pub(crate) handover: Option<Arc<Handover>>,
    door: Option<Arc<OperatorDoor>>,
}

/// An open port.
#[derive(Debug)]
pub(super) struct OperatorDoor {
    pub(super) server: OperatorServer,
    pub(super) desk: Arc<OperatorDesk>,
    /// Another one for each door.
    pub(super) instance: String,
    settings: OperatorSettings,
}

impl Continuity {
    /// The door of this page; another one, where it was another page before.
    ///
    /// # Errors
    /// The port cannot be had.
    pub(super) fn door(&mut self, wanted: &OperatorSetup) -> Result<Arc<OperatorDoor>, Failure> {
        if let Some(door) = self.door.take_if(|door| door.settings == wanted.server) {
            return Ok(self.door.insert(door).clone());
        }
        self.close();
        let desk = OperatorDesk::new(self.switch.clone(), self.scenes.clone());
        let desk = Arc::new(desk);
        let server = OperatorServer::start(wanted.server.clone(), desk.clone()).map_err(|error| {
            Failure::bad_input(format!(
                "[operator] cannot listen on port {} of 127.0.0.1 ({error}); free it or choose another port",
                wanted.server.port
            ))
        })?;
        let no_random = || Failure::failed("the system has no random numbers");
        let door = OperatorDoor {
            server,
            desk,
            instance: fresh_token().ok_or_else(no_random)?,
            settings: wanted.server.clone(),
        };
        Ok(self.door.insert(Arc::new(door)).clone())
    }

    /// For a session without a page.
    pub(crate) fn close(&mut self) {
        self.door = None;
    }
}
