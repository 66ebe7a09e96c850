//! Continuous collision detection: how far a body may move, and whether it is in penetration where it is.

mod advancement;
mod agenda;
mod bands;
mod beyond;
mod buckets;
mod collider;
mod deepest;
mod descent;
mod descent_in_motion;
mod discs;
mod displacements;
mod facing_volumes;
mod fall;
mod gaps;
mod gjk;
mod impact;
mod intersection;
mod intervals;
mod known_apart;
mod motion;
mod moving_piece;
mod obstacle_way;
mod one_to_eight;
mod problem;
#[cfg(test)]
mod processors_tests;
mod single;
mod still_pair;
mod time_of_impact;
mod turned;
mod turning;
mod windows;
mod work;
mod workspace;

pub use collider::Collider;
pub use impact::{AdvancementSettings, TimeOfImpact};
pub use intersection::{meshes_intersect, shapes_intersect, surfaces_intersect};
pub use motion::Motion;
pub use time_of_impact::time_of_impact;
pub use work::Work;
pub use workspace::CollisionWorkspace;

pub(crate) use bands::for_nearest_triangle_pairs;
pub(crate) use collider::distance_at_least;
pub(crate) use deepest::for_deepest_triangle_pairs;
pub(crate) use descent::for_facing_triangle_pairs;
pub(crate) use displacements::{MAX_MOTIONS, Motions};
pub(crate) use facing_volumes::Side;
pub(crate) use motion::Placement;
pub(crate) use obstacle_way::{ObstacleWay, time_of_impact_of_obstacle};
#[cfg(test)]
pub(crate) use processors_tests::bumpy_ball;
pub(crate) use still_pair::StillPair;
pub(crate) use workspace::{MAX_IMPLIED, MAX_WITNESSES};
