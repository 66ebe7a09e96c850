//! The operator's page of a session: what it shows, and what it does for whoever has shown the token.

mod desk;
mod door;
mod page;
mod picture_check;
mod pictures;
mod recent;
mod scene_desk;
mod scene_view;
mod settings;

pub(crate) use desk::NODE;
pub(crate) use door::Continuity;
pub(crate) use page::{Facts, Moment, OperatorPage};
pub(crate) use scene_desk::{AskedScene, SceneDesk, SceneWish};
pub(crate) use scene_view::{Standing, objects_of};
pub(crate) use settings::{OperatorSetup, operator_token};
