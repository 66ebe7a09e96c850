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
//! A box in the hand, pressed 5 mm into a table:
//!
//! ```
//! use std::sync::Arc;
//!
//! use god_object::nalgebra::{Matrix3, Point3, Vector3};
//! use god_object::spatial::linear;
//! use god_object::{Body, Coupling, GodObject, Mesh, Obstacle, Pose, Settings, Surface, World};
//!
//! /// A box about the origin with these half sides, m, its triangles counter-clockwise seen from outside.
//! fn box_of(half: [f64; 3]) -> Mesh {
//!     let side = |i: usize, axis: usize| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] };
//!     let corners = (0..8).map(|i| Point3::new(side(i, 0), side(i, 1), side(i, 2))).collect();
//!     let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
//!     let triangles = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
//!     Mesh::new(corners, triangles).expect("a closed surface")
//! }
//!
//! let world = Arc::new(World {
//!     body: Body {
//!         mesh: box_of([0.02, 0.02, 0.01]),
//!         primitive: None,
//!         mass: 1.0,
//!         inertia: Matrix3::identity() * 1e-4,
//!         reference_point: Point3::origin(),
//!     },
//!     obstacles: vec![Obstacle {
//!         name: "table".into(),
//!         mesh: box_of([0.5, 0.5, 0.05]),
//!         primitive: None,
//!         pose: Pose::translation(0.0, 0.0, -0.05),
//!         surface: Surface::default(),
//!     }],
//! });
//! let settings = world.settings_for(Settings::for_size(0.04));
//! let mut god_object = GodObject::new(world.clone(), settings, Pose::translation(0.0, 0.0, 0.03)).unwrap();
//! let mut coupling = Coupling::new(&world, &settings);
//!
//! // In a haptic PC these are two loops; here an update and a force take turns, a millisecond apart.
//! let device = Pose::translation(0.0, 0.0, 0.005);
//! let mut force: Vector3<f64> = Vector3::zeros();
//! for tick in 0..200 {
//!     god_object.step(&device, None);
//!     let time = 1e-3 * f64::from(tick);
//!     force = linear(&coupling.step(time, &device, god_object.constraint_set()).wrench);
//! }
//!
//! // The body lies on the table, above the hand; the hand feels a spring of k_s k_h m between the two, upward.
//! let height = god_object.pose().translation.z;
//! assert!((0.01..0.0101).contains(&height), "{height} m");
//! let spring = settings.k_s * settings.k_h * world.body.mass;
//! assert!((force - Vector3::new(0.0, 0.0, spring * (height - 0.005))).norm() < 1e-9, "{force} N");
//! ```
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
pub mod spatial;
pub mod surface;
mod turn_memory;
mod world;

pub use constraint::{ConstraintSet, NonPenetrationConstraint};
pub use coupling::{Coupling, CouplingOutput};
pub use geometry::{Mesh, Primitive};
pub use god_object::{GodObject, StartError, StepReport};
pub use nalgebra;
pub use quasi_statics::{ProjectionStatus, SolverKind};
pub use settings::{Adaptation, RotationMetric, Settings, SettingsError};
pub use spatial::{Pose, Vector6};
pub use surface::{
    HeightMap, HeightMapTexture, ShadedAcceleration, TextureCoordinates, UvHeightMapTexture,
};
pub use world::{Body, ForceShading, Obstacle, SineTexture, Surface, Texture, World};
