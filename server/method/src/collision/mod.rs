//! Continuous collision detection: how far a body may move, and whether it is in penetration where it is.

mod advancement;
mod distance;
mod intersection;
mod motion;
mod swept_box;
mod time_of_impact;
mod work;
mod workspace;

pub use distance::distance;
pub use intersection::meshes_intersect;
pub use motion::Motion;
pub use time_of_impact::{AdvancementSettings, TimeOfImpact, time_of_impact};
pub use work::Work;
pub use workspace::CollisionWorkspace;

pub(crate) use motion::{Placement, RelativeMotion};
pub(crate) use swept_box::{StillBoxes, for_triangle_pairs};
pub(crate) use workspace::{MAX_CANDIDATES, MAX_HINTS};
