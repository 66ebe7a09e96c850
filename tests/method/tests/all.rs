//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

mod assembly_scenes;
mod bunnies;
mod conforming_variants;
mod edges;
#[allow(
    dead_code,
    unused_imports,
    reason = "shared with another package, which uses the rest"
)]
#[path = "../../../server/method/tests/geometry_shapes/mod.rs"]
mod geometry_shapes;
mod ghost_plane;
mod hand_traces;
mod jamming;
mod machined_parts;
mod peg_clearances;
mod random_scenes;
mod scales;
mod still_hand;
mod thin_walls;
