//! Scenes: what the hand holds, what it may touch, how it feels.

mod auto_fidelity;
mod build;
mod built;
mod drawn;
mod edit;
mod fidelity_choices;
mod file_faults;
mod load;
mod opacities;
mod parse;
mod parse_look;
mod parse_mesh_file;
mod parse_shape;
mod pieces;
mod prepared;
mod settings_tables;
mod shipped;
mod spec;

pub use built::{BuiltBody, BuiltHand, BuiltMotion, BuiltScene, Carried, GOD_OBJECT_NAME};
pub use edit::EditedKey;
pub(crate) use edit::RESERVED_NAMES;
pub(crate) use file_faults::file_faults;
pub(crate) use load::unusable;
pub use load::{Scene, SceneSource};
pub(crate) use parse::MAX_OBSTACLES;
pub(crate) use parse_mesh_file::LENGTH_UNITS;
pub(crate) use parse_shape::pose_of;
pub use prepared::{Prepared, Sources};
pub use settings_tables::{CouplingSpec, LimitSpec, MethodSpec};
pub use shipped::{SHIPPED_SCENES, ShippedScene, shipped_scene_text};
pub use spec::{
    BodySpec, Carrier, HandPathSpec, HeightMapMapping, HeightMapSpec, MassSpec, MotionSpec,
    ObstacleSpec, ReferencePoint, ScenerySpec, Shape, View,
};
