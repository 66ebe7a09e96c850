//! What clients fetch at join: the scene description, and meshes, textures and light by hash.

use crate::LinkError;
use std::{collections::HashMap, sync::Arc};
use taut_proto::{
    CouplingOffer, MeshBlob, MeshHash, Panorama, SceneDescription, Texture, control::ControlMessage,
};

/// What clients fetch at join.
#[derive(Clone, Debug)]
pub struct Content {
    /// The scene, the workbench.
    pub description: SceneDescription,
    /// Every mesh that the description names.
    pub meshes: Vec<MeshBlob>,
    /// Every texture that a mesh names.
    pub textures: Vec<Arc<Texture>>,
    /// The light that the description names, if it names any.
    pub panorama: Option<Panorama>,
}

/// The same as bytes, made once.
pub(crate) struct EncodedContent {
    /// The framed scene message.
    pub(crate) scene: Vec<u8>,
    /// The framed message about coupling, for the device bridge.
    pub(crate) coupling: Vec<u8>,
    /// Meshes, textures, and the panorama.
    pub(crate) blobs: HashMap<MeshHash, Arc<[u8]>>,
    /// Names of the workbench's render nodes.
    pub(crate) nodes: Vec<String>,
}

impl Content {
    /// Refuses a description that cannot be sent: what [`serve`](crate::serve) would refuse.
    ///
    /// # Errors
    /// A number out of its range, a text that is too long, more than a message holds.
    pub fn check(&self) -> Result<(), LinkError> {
        let sent = ControlMessage::Scene(self.description.clone()).to_frame();
        sent.map(drop).map_err(|error| LinkError::Content {
            reason: error.to_string(),
        })
    }

    /// Encodes everything; an error if the description names what is not there.
    pub(crate) fn encode(self, coupling: CouplingOffer) -> Result<EncodedContent, LinkError> {
        let refuse = |reason: String| LinkError::Content { reason };
        let mut blobs: HashMap<MeshHash, Arc<[u8]>> = HashMap::new();
        for mesh in &self.meshes {
            let bytes = mesh.encode().map_err(|error| refuse(error.to_string()))?;
            blobs.insert(MeshHash::of(&bytes), Arc::from(bytes));
        }
        for texture in &self.textures {
            let bytes = texture.encode();
            blobs.insert(MeshHash::of(&bytes), Arc::from(bytes));
        }
        let textures = self.meshes.iter().filter_map(MeshBlob::textures);
        for one in textures.flat_map(|textures| &textures.list) {
            if !blobs.contains_key(&one.texture) {
                return Err(refuse(format!(
                    "a mesh names texture {}, which is not among its textures; add it",
                    one.texture
                )));
            }
        }
        if let Some(panorama) = &self.panorama {
            let bytes = panorama.encode();
            blobs.insert(MeshHash::of(&bytes), Arc::from(bytes));
        }
        let described = [&self.description.god_object];
        for body in described.into_iter().chain(&self.description.obstacles) {
            if !blobs.contains_key(&body.mesh) {
                return Err(refuse(format!(
                    "body \"{}\" names mesh {}, which is not among its meshes; add it",
                    body.name, body.mesh
                )));
            }
        }
        if let Some(hash) = self.description.environment
            && !blobs.contains_key(&hash)
        {
            return Err(refuse(format!(
                "the scene's light is {hash}, which is not its panorama; add it"
            )));
        }
        let nodes = self
            .description
            .nodes
            .iter()
            .map(|node| node.name.raw().to_owned())
            .collect();
        let scene = ControlMessage::Scene(self.description)
            .to_frame()
            .map_err(|error| refuse(error.to_string()))?;
        let coupling = ControlMessage::Coupling(coupling)
            .to_frame()
            .map_err(|error| refuse(error.to_string()))?;
        Ok(EncodedContent {
            scene,
            coupling,
            blobs,
            nodes,
        })
    }
}
