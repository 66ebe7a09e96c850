//! The operator's page of a session: what it shows, and what it does for whoever has shown the token.

mod desk;
mod page;
mod recent;
mod settings;

pub(crate) use page::{Facts, Moment, OperatorPage};
pub(crate) use settings::OperatorSetup;
