//! Continuous collision detection: how far a body may move, and whether it is in penetration where it is.

mod advancement;
mod agenda;
mod bands;
mod beyond;
mod deepest;
mod descent;
mod descent_in_motion;
mod displacements;
mod distance;
mod facing_volumes;
mod fall;
mod gaps;
mod impact;
mod intersection;
mod intervals;
mod known_apart;
mod linear;
mod motion;
#[cfg(test)]
mod processors_tests;
mod single;
mod still_box;
mod time_of_impact;
mod turned;
mod windows;
mod work;
mod workspace;

pub use distance::distance;
pub use impact::{AdvancementSettings, TimeOfImpact};
pub use intersection::meshes_intersect;
pub(crate) use intersection::surfaces_intersect;
pub use linear::{edge_edge_time_of_impact, vertex_face_time_of_impact};
pub use motion::Motion;
pub use time_of_impact::time_of_impact;
pub use work::Work;
pub use workspace::CollisionWorkspace;

pub(crate) use bands::for_nearest_triangle_pairs;
pub(crate) use deepest::for_deepest_triangle_pairs;
pub(crate) use descent::for_facing_triangle_pairs;
pub(crate) use displacements::{MAX_MOTIONS, Motions};
pub(crate) use facing_volumes::{FacingVolumes, Side};
pub(crate) use fall::time_to_fall;
pub(crate) use gaps::Gaps;
pub(crate) use motion::{Placement, RelativeMotion};
pub(crate) use workspace::{MAX_CANDIDATES, MAX_WITNESSES};
