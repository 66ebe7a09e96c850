//! Primitives: exact, and as triangle meshes within them.
//!
//! A scene's primitive is exact unless it names its tessellation ([`Shape`](crate::Shape)). The mesh is drawn either way.
//!
//! All meshes are closed and seen anticlockwise from outside. The frame of each is centred and, where the shape has an
//! axis, along y unless another is asked for, as in the paper's peg-in-a-hole.

mod axis;
mod board;
mod box_with_hole;
mod capsule;
mod cuboid;
mod cylinder;
mod exact;
mod hand;
mod plane;
mod sphere;

pub use axis::Axis;
pub use board::BoardText;
pub(crate) use board::{board, fault as board_fault};
pub use box_with_hole::box_with_hole;
pub(crate) use box_with_hole::hole_circumradius;
pub use capsule::capsule;
pub use cuboid::cuboid;
pub use cylinder::cylinder;
pub(crate) use exact::{exact_capsule, exact_cylinder, exact_plane, exact_sphere};
pub(crate) use hand::hand;
pub(crate) use plane::PLATE;
pub use plane::plane;
pub use sphere::sphere;
