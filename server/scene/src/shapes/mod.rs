//! Primitives as triangle meshes. In this version every primitive of a scene is tessellated.
//!
//! All meshes are closed and seen anticlockwise from outside. The frame of each is centred and, where the shape has an
//! axis, along y unless another is asked for, as in the paper's peg-in-a-hole.

mod axis;
mod box_with_hole;
mod capsule;
mod cuboid;
mod cylinder;
mod plane;
mod sphere;

pub use axis::Axis;
pub use box_with_hole::box_with_hole;
pub(crate) use box_with_hole::hole_circumradius;
pub use capsule::capsule;
pub use cuboid::cuboid;
pub use cylinder::cylinder;
pub use plane::plane;
pub use sphere::sphere;
