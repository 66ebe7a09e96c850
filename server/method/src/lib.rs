//! A six-degree-of-freedom god-object method for haptic display of rigid bodies.
//!
//! The body in the user's hand, the *god-object*, follows the haptic device without ever penetrating an obstacle. Its motion
//! is Gauss' principle of least constraint on the contacts at hand ([`quasi_statics`]), limited by continuous collision
//! detection ([`collision`]); the force is the constraint force of the same projection with the device's pose
//! ([`Coupling`]).
//!
//! | symbol | name                               | unit    | meaning                                                 |
//! |--------|------------------------------------|---------|---------------------------------------------------------|
//! | x_h    | `device_pose`                      | m, –    | pose of the haptic device, world from body              |
//! | x_s    | [`GodObject::pose`]                | m, –    | pose of the god-object, world from body                 |
//! | G      | [`Body::reference_point`]          | m       | point at which motion is split and wrenches act         |
//! | a_u    | unconstrained acceleration         | m, rad  | `k_s (x_h - x_s)`, applied as a displacement            |
//! | a_c    | constrained acceleration           | m, rad  | a_u projected on the constraint set                     |
//! | M      | [`quasi_statics::Metric`]          | kg, kg m^2 | mass and inertia about G, world axes                 |
//! | J      | [`constraint::contact_jacobian`]   |         | one row for each contact                                |
//! | F_c    | [`CouplingOutput::wrench`]         | N, N m  | constraint force at G                                   |
//!
//! Poses are those of a body's own frame, the frame of its mesh. Six-vectors are linear, then angular, in world axes. SI
//! units throughout. The crate does no I/O, has no threads and no clock: time is an argument, so the same code runs
//! in the loops of a haptic PC and offline, with the same answers.
//!
//! Source: M. Ortega, S. Redon, S. Coquillart, "A Six Degree-of-Freedom God-Object Method for Haptic Display of Rigid Bodies
//! with Surface Properties", IEEE TVCG 13(3), 2007. `REFERENCES.md` maps its sections to files.
#![forbid(unsafe_code)]

mod adaptation;
pub mod collision;
pub mod constraint;
mod coupling;
mod damping;
pub mod geometry;
mod god_object;
mod implicit;
mod known_rows;
mod obstacle_work;
mod prepared_rows;
pub mod quasi_statics;
mod settings;
pub mod shape;
pub mod spatial;
pub mod surface;
mod turn_memory;
mod world;

pub use constraint::{ConstraintSet, NonPenetrationConstraint};
pub use coupling::{Coupling, CouplingOutput};
pub use geometry::Mesh;
pub use god_object::{GodObject, StartError, StepReport};
pub use nalgebra;
pub use quasi_statics::{ProjectionStatus, SolverKind};
pub use settings::{Adaptation, RotationMetric, Settings, SettingsError};
pub use shape::Primitive;
pub use spatial::{Pose, Vector6};
pub use surface::{
    HeightMap, HeightMapTexture, ShadedAcceleration, TextureCoordinates, UvHeightMapTexture,
};
pub use world::{Body, ForceShading, Obstacle, SineTexture, Surface, Texture, World};
