//! What the whole-system tests of taut share: scenes under a virtual clock, an independent check for penetration, and real
//! processes that never outlive their test.
//!
//! - [`checker`]: do two meshes intersect? By code that shares nothing with the method. It rests on [`triangles`].
//! - [`motion`]: a scene's god-object led along a path, recorded.
//! - [`workbench`]: a workbench file and a cluster key in a directory of their own, one running workbench at a time.
//! - [`process`]: the program under test as a process.
//! - [`patience`]: waiting for a condition with a deadline.

pub mod checker;
pub mod motion;
pub mod patience;
pub mod process;
pub mod triangles;
pub mod workbench;
