//! The options of a node that say what it does without a server, and where it keeps meshes.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use taut_link::{MeshCache, RejoinPolicy};

use crate::cli::within;
use crate::error::RenderError;

/// Longest time that may be named for giving up, in seconds: more than thirty years.
const LONGEST_S: f64 = 1e9;

/// What a node does when its server goes, and what it keeps.
#[derive(Args, Clone, Debug, Default)]
pub struct MembershipArgs {
    /// Stay when the server stops, and wait for one that is not there yet: for a node that runs as a service.
    #[arg(long)]
    pub stay: bool,
    /// End when there was no server for this many seconds [default: a node whose link is lost tries for ever].
    #[arg(long, value_name = "SECONDS")]
    pub give_up: Option<f64>,
    /// Keep meshes in this folder [default: taut/meshes in the user's cache].
    #[arg(long, value_name = "DIR", conflicts_with = "no_mesh_cache")]
    pub mesh_cache: Option<PathBuf>,
    /// Keep no meshes on disk.
    #[arg(long)]
    pub no_mesh_cache: bool,
}

impl MembershipArgs {
    /// As the link takes it.
    pub(crate) fn policy(&self) -> Result<RejoinPolicy, RenderError> {
        let give_up = self
            .give_up
            .map(|seconds| within("--give-up", seconds, 0.0, LONGEST_S));
        Ok(RejoinPolicy {
            stay: self.stay,
            give_up: give_up.transpose()?.map(Duration::from_secs_f64),
            ..RejoinPolicy::default()
        })
    }

    /// The cache to use. A folder that was named must be usable; without the user's own the node draws all the same.
    pub(crate) fn cache(&self) -> Result<Option<Arc<MeshCache>>, RenderError> {
        if self.no_mesh_cache {
            return Ok(None);
        }
        if let Some(folder) = &self.mesh_cache {
            let opened = MeshCache::open(folder).map_err(|error| RenderError::MeshCache {
                path: folder.clone(),
                reason: error.to_string(),
            });
            return opened.map(|cache| Some(Arc::new(cache)));
        }
        let Some(folder) = MeshCache::default_directory() else {
            return Ok(None);
        };
        match MeshCache::open(&folder) {
            Ok(cache) => Ok(Some(Arc::new(cache))),
            Err(error) => {
                tracing::warn!(
                    "no meshes are kept in {} ({error}); name another folder with --mesh-cache",
                    folder.display()
                );
                Ok(None)
            }
        }
    }
}
