//! The mouse of a window holds the body: drags on a screen become motions of the held body in the world.
//!
//! | symbol | name in code         | unit | meaning                                                              |
//! |--------|----------------------|------|----------------------------------------------------------------------|
//! | pe     | `eye`                | m    | the eye that sees the picture under the mouse, workbench frame       |
//! | ps     | [`Screen::point`]    | m    | the mouse on the screen, workbench frame                             |
//! | G      | `grip`               | m    | reference point of the held body, workbench frame                    |
//! | n      | [`Screen::normal`]   | –    | towards the viewer                                                   |
//!
//! - **Along the screen**: the ray pe → ps meets the plane through G parallel to the screen; G moves as that point does, so
//!   it stays under the mouse.
//! - **To and fro**: G moves on the ray pe → G, away from the eye for a drag upwards; on the screen it stays where it is.
//! - **Turn**: about G; a drag across the screen's height turns by half a turn, the side that faces the viewer with the mouse.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point3, Similarity3, UnitQuaternion, Vector3};

use crate::stage::Stage;
use crate::view::Screen;

/// Nearest that G comes to the eye, m on the workbench: nearer it would fill the picture.
const NEAREST: f64 = 0.15;
/// Farthest that G goes from the eye, m on the workbench.
const FARTHEST: f64 = 10.0;

/// A place on a screen: fractions of its width from the left, and of its height from below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// From the left.
    pub across: f64,
    /// From below.
    pub upward: f64,
}

/// What a drag does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drag {
    /// Moves the body along the screen.
    Along,
    /// Moves it to and fro.
    Depth,
    /// Turns it.
    Turn,
}

/// Where the held body is led to. Pure: events in, a pose out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    start: Isometry3<f64>,
    /// World from body.
    target: Isometry3<f64>,
    reference_point: Point3<f64>,
    workbench_from_world: Similarity3<f64>,
    is_held: bool,
}

impl Hold {
    /// Holds the stage's body at its start.
    pub fn new(stage: &Stage) -> Self {
        Self::at(
            stage.god_object.pose,
            stage.reference_point,
            stage.workbench_from_scene,
        )
    }

    /// Holds a body at its start, world from body; its reference point is in its own frame.
    pub fn at(
        start: Isometry3<f64>,
        reference_point: Point3<f64>,
        workbench_from_world: Similarity3<f64>,
    ) -> Self {
        Self {
            start,
            target: start,
            reference_point,
            workbench_from_world,
            is_held: true,
        }
    }

    /// Holds the body of another scene, at its start; lets go of it if it had let go. Where the body begins as before, the scene was
    /// edited, and the device stays where it is.
    pub fn follow(&mut self, other: Self) {
        let place = |hold: &Self| (hold.start, hold.reference_point, hold.workbench_from_world);
        if place(self) != place(&other) {
            let is_held = self.is_held;
            *self = Self { is_held, ..other };
        }
    }

    /// World from body.
    pub fn target(&self) -> &Isometry3<f64> {
        &self.target
    }

    /// Whether drags move the body.
    pub fn is_held(&self) -> bool {
        self.is_held
    }

    /// Leads the body back to its start.
    pub fn reset(&mut self) {
        self.target = self.start;
    }

    /// Lets go, with the body left where the god-object is at `world_from_body`, so that nothing pulls; or takes hold there.
    pub fn toggle(&mut self, world_from_body: &Isometry3<f64>) {
        self.is_held = !self.is_held;
        self.target = *world_from_body;
    }

    /// The mouse went from one place to another on `screen`, which `eye` (workbench frame) looks at.
    pub fn drag(&mut self, drag: Drag, screen: &Screen, eye: &Point3<f64>, from: Place, to: Place) {
        if !self.is_held {
            return;
        }
        let (dx, dy) = (to.across - from.across, to.upward - from.upward);
        match drag {
            Drag::Along => {
                let there = [from, to].map(|place| self.under_mouse(screen, eye, place));
                if let [Some(from), Some(to)] = there {
                    self.shift(&(to - from), eye);
                }
            }
            Drag::Depth => {
                let away = self.grip() - eye;
                self.shift(&(away * (dy * screen.height() / screen.distance(eye))), eye);
            }
            Drag::Turn => {
                let aspect = screen.width() / screen.height();
                let turn = (screen.up() * (dx * aspect) - screen.right() * dy) * PI;
                self.turn(&turn);
            }
        }
    }

    /// G, workbench frame.
    fn grip(&self) -> Point3<f64> {
        self.workbench_from_world * (self.target * self.reference_point)
    }

    /// Where the ray through the mouse meets the plane of G; `None` where it does not.
    fn under_mouse(&self, screen: &Screen, eye: &Point3<f64>, place: Place) -> Option<Point3<f64>> {
        let ray = screen.point(place.across, place.upward) - eye;
        let ahead = (self.grip() - eye).dot(&screen.normal()) / ray.dot(&screen.normal());
        (ahead > 0.0 && ahead.is_finite()).then(|| eye + ray * ahead)
    }

    /// Moves G on the workbench, unless that takes it too near to the eye or too far away. One that is, comes back step by step.
    fn shift(&mut self, displacement: &Vector3<f64>, eye: &Point3<f64>) {
        let beyond = |grip: Point3<f64>| {
            let distance = (grip - eye).norm();
            (distance - distance.clamp(NEAREST, FARTHEST)).abs()
        };
        let in_reach = beyond(self.grip() + displacement) <= beyond(self.grip()); // false for NaN
        if in_reach {
            let in_world = self
                .workbench_from_world
                .inverse_transform_vector(displacement);
            self.target.translation.vector += in_world;
        }
    }

    /// Turns the body about G by a rotation vector of the workbench frame.
    fn turn(&mut self, turn: &Vector3<f64>) {
        if !turn.iter().all(|x| x.is_finite()) {
            return;
        }
        let in_world = self
            .workbench_from_world
            .isometry
            .inverse_transform_vector(turn);
        let grip = self.target * self.reference_point;
        let rotation = UnitQuaternion::from_scaled_axis(in_world) * self.target.rotation;
        let lever = rotation * self.reference_point.coords;
        self.target = Isometry3::from_parts((grip.coords - lever).into(), rotation);
        self.target.rotation.renormalize();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{ClipPlanes, project};
    use proptest::prelude::*;

    const PLANES: ClipPlanes = ClipPlanes {
        near: 0.05,
        far: 20.0,
    };

    fn screen() -> Screen {
        let corner = |x, z| Point3::new(x, 0.1 * z, z);
        Screen::from_corners(corner(-0.9, 0.0), corner(0.9, 0.0), corner(-0.9, 1.2))
            .expect("a screen")
    }

    fn hold() -> Hold {
        let origin = Isometry3::new(Vector3::new(0.0, -0.45, 0.25), Vector3::z() * 0.4);
        let start = Isometry3::new(Vector3::new(0.0, 0.0, 0.1), Vector3::x() * 0.3);
        let workbench_from_world = Similarity3::from_isometry(origin, 2.5);
        Hold::at(start, Point3::new(0.01, -0.02, 0.03), workbench_from_world)
    }

    fn eye() -> Point3<f64> {
        Point3::new(0.05, -1.3, 0.9)
    }

    /// Where G is drawn, as a place on the screen.
    fn seen(hold: &Hold) -> Place {
        let clip = screen()
            .clip_from_workbench(&eye(), &PLANES)
            .expect("in front");
        let point = project(&clip, &hold.grip()).expect("in front of the eye");
        Place {
            across: 0.5 + 0.5 * point.x,
            upward: 0.5 + 0.5 * point.y,
        }
    }

    fn place(across: f64, upward: f64) -> Place {
        Place { across, upward }
    }

    proptest! {
        /// The projection that draws the picture is the oracle: what was dragged along is drawn where the mouse went.
        #[test]
        fn what_is_dragged_along_stays_under_the_mouse_and_at_its_depth(across in -0.3..0.3_f64, upward in -0.3..0.3_f64) {
            let mut hold = hold();
            let from = seen(&hold);
            let depth = screen().distance(&hold.grip());
            let to = place(from.across + across, from.upward + upward);
            hold.drag(Drag::Along, &screen(), &eye(), from, to);
            let now = seen(&hold);
            prop_assert!((now.across - to.across).abs() + (now.upward - to.upward).abs() < 1e-9);
            prop_assert!((screen().distance(&hold.grip()) - depth).abs() < 1e-12);
            prop_assert_eq!(hold.target.rotation, hold.start.rotation);
        }

        #[test]
        fn what_is_pushed_away_stays_under_the_mouse_and_comes_back(upward in -0.4..0.4_f64) {
            let mut hold = hold();
            let (before, distance) = (seen(&hold), (hold.grip() - eye()).norm());
            hold.drag(Drag::Depth, &screen(), &eye(), place(0.5, 0.5), place(0.5, 0.5 + upward));
            let after = seen(&hold);
            prop_assert!((after.across - before.across).abs() + (after.upward - before.upward).abs() < 1e-9);
            let moved = (hold.grip() - eye()).norm() - distance;
            prop_assert!(moved * upward >= 0.0 && (upward.abs() < 1e-6 || moved != 0.0));
        }

        #[test]
        fn a_turn_leaves_the_grip_where_it_is(across in -1.0..1.0_f64, upward in -1.0..1.0_f64) {
            let mut hold = hold();
            let before = hold.grip();
            hold.drag(Drag::Turn, &screen(), &eye(), place(0.0, 0.0), place(across, upward));
            prop_assert!((hold.grip() - before).norm() < 1e-12);
        }
    }

    #[test]
    fn the_side_that_faces_the_viewer_turns_with_the_mouse() {
        for (to, moves) in [
            (place(0.6, 0.5), screen().right()),
            (place(0.5, 0.6), screen().up()),
        ] {
            let mut hold = hold();
            let front_in_world = hold
                .workbench_from_world
                .isometry
                .inverse_transform_vector(&screen().normal());
            let before = hold.target.rotation;
            hold.drag(Drag::Turn, &screen(), &eye(), place(0.5, 0.5), to);
            let turn = hold.target.rotation * before.inverse();
            let moved = hold
                .workbench_from_world
                .isometry
                .transform_vector(&(turn * front_in_world - front_in_world));
            assert!(moved.dot(&moves) > 0.1, "{moved}");
        }
    }

    #[test]
    fn what_is_let_go_stays_at_the_god_object_and_is_taken_up_there() {
        let mut hold = hold();
        let god_object = Isometry3::translation(0.01, 0.02, 0.03);
        let (from, to) = (place(0.5, 0.5), place(0.6, 0.5));
        hold.toggle(&god_object);
        hold.drag(Drag::Along, &screen(), &eye(), from, to);
        assert_eq!((hold.is_held(), *hold.target()), (false, god_object));
        hold.toggle(&god_object);
        hold.drag(Drag::Along, &screen(), &eye(), from, to);
        assert!(hold.is_held() && *hold.target() != god_object);
        hold.reset();
        assert_eq!(*hold.target(), hold.start);
    }

    #[test]
    fn another_scene_s_body_is_held_at_its_start_an_edited_one_s_as_before() {
        let mut hold = hold();
        let begun = hold;
        let (from, to) = (place(0.5, 0.5), place(0.6, 0.5));
        hold.drag(Drag::Along, &screen(), &eye(), from, to);
        let dragged = hold;
        hold.follow(begun);
        assert_eq!(hold, dragged);
        let start = Isometry3::translation(0.0, 0.0, 0.2);
        let other = Hold::at(start, Point3::origin(), Similarity3::identity());
        hold.follow(other);
        assert_eq!(hold, other);
        hold.toggle(&start);
        hold.follow(begun);
        assert!(!hold.is_held() && *hold.target() == begun.start);
    }

    #[test]
    fn what_is_out_of_reach_comes_back_by_steps_and_goes_no_further() {
        for (away, back) in [(0.1, 0.01), (12.0, -0.01)] {
            for (upward, moves) in [(back, true), (-back, false)] {
                let (ahead, to) = (-screen().normal() * away, place(0.5, 0.5 + upward));
                let start = Isometry3::from(eye().coords + ahead);
                let mut hold = Hold::at(start, Point3::origin(), Similarity3::identity());
                hold.drag(Drag::Depth, &screen(), &eye(), place(0.5, 0.5), to);
                assert_eq!(*hold.target() != start, moves, "{upward} from {away} m");
            }
        }
    }

    #[test]
    fn nothing_goes_through_the_eye_or_out_of_sight() {
        for to in [place(0.5, -50.0), place(0.5, 50.0), place(0.5, f64::NAN)] {
            for drag in [Drag::Depth, Drag::Along, Drag::Turn] {
                let mut hold = hold();
                hold.drag(drag, &screen(), &eye(), place(0.5, 0.5), to);
                let distance = (hold.grip() - eye()).norm();
                assert!(
                    (NEAREST..=FARTHEST).contains(&distance),
                    "{drag:?} {to:?}: {distance}"
                );
            }
        }
    }
}
