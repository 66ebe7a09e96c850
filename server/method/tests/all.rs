//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

use assert_no_alloc::AllocDisabler;

mod collision_facing;
mod collision_query_sets;
mod collision_time_of_impact;
mod contact_collection;
mod coupling_adaptation;
mod coupling_damping;
mod coupling_samples;
mod coupling_sets;
mod exact_collision;
mod geometry_distance;
mod geometry_mesh;
mod geometry_shapes;
mod glossary;
mod god_object_box_on_table;
mod god_object_convergence;
mod god_object_flat_landing;
mod god_object_peg_in_hole;
mod implicit_constraints;
mod late_updates;
mod many_obstacles;
mod mesh_distance;
mod mesh_impact;
mod moving_friction;
mod moving_friction_variants;
mod moving_half_spaces;
mod moving_obstacles;
mod no_alloc_steps;
mod passing_corners;
mod projection_agreement;
mod projection_hard_cases;
mod projection_no_alloc;
mod projection_properties;
mod projection_recipes;
mod projection_support;
mod row_reduction;
mod shape_contacts;
mod shape_god_object;
mod shape_support;
mod shape_time_of_impact;
mod stops_without_force;
mod support;
mod surface_friction;
mod surface_shading;
mod surface_texture;
mod taken_along;

/// Counts by thread: a test that forbids allocation forbids its own.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;
