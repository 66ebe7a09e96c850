//! Contacts of two exact forms, and of a body on a block.

use god_object::nalgebra::Point3;
use god_object::{Mesh, Primitive};

use super::body::BodyNeed;
use super::contact::{Contact, Late};
use super::errors::longest_lag;
use super::met::Met;
use super::need::SceneNeed;
use crate::shapes;

pub(super) fn sphere(radius: f64) -> BodyNeed {
    let center = Point3::origin();
    let raw = shapes::sphere(radius, 1);
    let mesh = Mesh::new(raw.vertices, raw.triangles).expect("a closed shape");
    let primitive = Primitive::Sphere { center, radius };
    BodyNeed::of_primitive("a", &primitive, &mesh, &Met::default())
}

fn block() -> BodyNeed {
    let raw = shapes::cuboid([0.02, 0.03, 0.01]);
    let mesh = Mesh::new(raw.vertices, raw.triangles).expect("a closed shape");
    BodyNeed::of_mesh("b", &mesh, &Met::default())
}

pub(super) fn need(body: BodyNeed, obstacle: BodyNeed) -> SceneNeed {
    SceneNeed {
        body,
        obstacles: vec![obstacle],
        size: 0.04,
        lever: 0.0,
        stiffness: 1000.0,
        k_s: 1.0,
        speed: 0.15,
        turn_rate: 1.0,
        force: 2.0,
        widest_tolerance: 1.8e-6,
    }
}

fn contact(need: &SceneNeed) -> Contact<'_> {
    Contact {
        need,
        obstacle: &need.obstacles[0],
        errors: [0.0; 2],
    }
}

fn late(need: &SceneNeed, rate: f64, rounds: u32) -> Late {
    contact(need).late(rate, rounds)
}

#[test]
fn two_spheres_turn_about_each_other_like_the_sum_of_their_radii() {
    let need = need(sphere(0.02), sphere(0.03));
    assert!((contact(&need).curvature() - 20.0).abs() < 1e-9);
}

#[test]
fn rows_that_follow_a_round_body_need_no_rate() {
    let need = need(sphere(0.01), sphere(0.02));
    let (linear, followed) = (late(&need, 70.0, 0), late(&need, 70.0, 2));
    assert!(linear.direction > 10.0 * followed.direction);
    assert!(linear.ripple > 5.0 * followed.ripple);
}

#[test]
fn an_edge_is_felt_at_slow_updates_and_not_on_a_plane() {
    let edge = need(sphere(0.008), block());
    let [slow, fast] = [70.0, 1000.0].map(|rate| late(&edge, rate, 2));
    assert!(slow.edges > 1.0, "{slow:?}");
    assert!(fast.edges < 0.5, "{fast:?}");
    let plane = BodyNeed {
        curvature: 0.0,
        ..sphere(1.0)
    };
    assert_eq!(late(&need(sphere(0.008), plane), 70.0, 0), Late::default());
}

#[test]
fn friction_makes_an_edge_felt_more() {
    let smooth = need(sphere(0.008), block());
    let rough = BodyNeed {
        friction: 0.5,
        ..block()
    };
    let rough = need(sphere(0.008), rough);
    let [smooth, rough] = [smooth, rough].map(|need| late(&need, 300.0, 0).ripple);
    assert!((rough / smooth - 1.25_f64.sqrt()).abs() < 1e-9);
}

#[test]
fn faces_that_turn_on_an_edge_turn_the_normal() {
    let held = need(block(), block());
    let turns = SceneNeed {
        lever: 0.03,
        speed: 0.0,
        ..held
    };
    let [none, one] = [0, 1].map(|rounds| late(&turns, 70.0, rounds));
    let angle = turns.turn_rate * longest_lag(1.0, 70.0);
    assert!((none.direction - 2.0 * angle / 0.1).abs() < 1e-9);
    assert!(one.direction < 0.05 * none.direction);
}
