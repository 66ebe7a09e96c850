//! What the tests of the method on whole scenes share: a virtual clock, a hand that errs, and an independent check for penetration.
//!
//! - [`checker`]: do two meshes intersect? By code that shares nothing with the method. It rests on [`triangles`].
//! - [`motion`]: a scene's god-object led along a path, recorded.
//! - [`hand`]: what a hand adds to the path that it means to follow.
//! - [`solids`]: bodies and obstacles made in code.
//! - [`machined`]: gears and threads.
//! - [`variants`]: conforming contact in many variants, and what is measured in each.
//! - [`assembly`]: the insertion scenes of the test data and what must come of them.

pub mod assembly;
pub mod checker;
pub mod hand;
pub mod machined;
pub mod motion;
pub mod solids;
pub mod triangles;
pub mod variants;
