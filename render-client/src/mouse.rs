//! Mouse and keys of a window, as drags of the held body.
//!
//! | input                                  | drag                                             |
//! |----------------------------------------|--------------------------------------------------|
//! | left button                            | along the screen                                 |
//! | right button, wheel, Page Up / Down    | to and fro                                       |
//! | middle button, Shift + left            | turn                                             |
//! | arrow keys; with Shift                 | along the screen by small steps; turn            |
//! | P                                      | let go, take hold                                |
//! | R                                      | back to the start                                |

use nalgebra::Point3;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::{KeyCode, ModifiersState, PhysicalKey};

use crate::hold::{Drag, Hold, Place};
use crate::stereo::Picture;
use crate::view::{Eye, Eyes, Screen};

/// What is said of the keys, in the window's title.
pub(crate) const HELP: &str =
    "left: move, right/wheel: to and fro, middle/Shift: turn, P: let go, R: start";
/// A key's step, in heights of the screen.
const KEY_STEP: f64 = 0.01;
/// A line of the wheel, in heights of the screen.
const WHEEL_STEP: f64 = 0.02;
/// Pixels of a smooth wheel that make a line.
const PIXELS_PER_LINE: f64 = 40.0;

/// The picture under the mouse.
pub(crate) struct Pointed<'a> {
    pub(crate) screen: &'a Screen,
    pub(crate) picture: &'a Picture,
    /// Of the window, pixels.
    pub(crate) size: (f64, f64),
    pub(crate) eyes: &'a Eyes,
}

/// What mouse and keys are doing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Mouse {
    at: Option<(f64, f64)>,
    drag: Option<(Drag, MouseButton)>,
    shift: bool,
    buttons: u16,
}

impl Mouse {
    /// One bit per button that is down: left, right, middle.
    pub(crate) fn buttons(&self) -> u16 {
        self.buttons
    }

    /// Modifier keys changed.
    pub(crate) fn modifiers(&mut self, state: ModifiersState) {
        self.shift = state.shift_key();
    }

    /// Takes an event of a window in; whether the body was moved or a button changed.
    pub(crate) fn event(
        &mut self,
        event: &WindowEvent,
        pointed: &Pointed<'_>,
        hold: &mut Hold,
    ) -> bool {
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let to = (position.x, position.y);
                let from = self.at.replace(to);
                if let (Some((drag, _)), Some(from)) = (self.drag, from) {
                    self.move_between(drag, from, to, pointed, hold);
                    return true;
                }
                false
            }
            WindowEvent::CursorLeft { .. } if self.drag.is_none() => {
                self.at = None;
                false
            }
            WindowEvent::MouseInput { state, button, .. } => {
                self.button(*state, *button);
                true
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let lines = match delta {
                    MouseScrollDelta::LineDelta(_, y) => f64::from(*y),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_LINE,
                };
                step(Drag::Depth, 0.0, lines * WHEEL_STEP, pointed, hold);
                true
            }
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                self.key(event.physical_key, pointed, hold)
            }
            _ => false,
        }
    }

    fn button(&mut self, state: ElementState, button: MouseButton) {
        let (bit, drag) = match button {
            MouseButton::Left if self.shift => (1, Drag::Turn),
            MouseButton::Left => (1, Drag::Along),
            MouseButton::Right => (2, Drag::Depth),
            MouseButton::Middle => (4, Drag::Turn),
            _ => return,
        };
        match state {
            ElementState::Pressed => {
                self.buttons |= bit;
                self.drag = Some((drag, button));
            }
            ElementState::Released => {
                self.buttons &= !bit;
                // Another button that is still down goes on.
                self.drag = self.drag.filter(|(_, by)| *by != button);
            }
        }
    }

    fn key(&self, key: PhysicalKey, pointed: &Pointed<'_>, hold: &mut Hold) -> bool {
        let PhysicalKey::Code(code) = key else {
            return false;
        };
        let (drag, across, upward) = match code {
            KeyCode::ArrowLeft => (Drag::Along, -KEY_STEP, 0.0),
            KeyCode::ArrowRight => (Drag::Along, KEY_STEP, 0.0),
            KeyCode::ArrowUp => (Drag::Along, 0.0, KEY_STEP),
            KeyCode::ArrowDown => (Drag::Along, 0.0, -KEY_STEP),
            KeyCode::PageUp => (Drag::Depth, 0.0, KEY_STEP),
            KeyCode::PageDown => (Drag::Depth, 0.0, -KEY_STEP),
            _ => return false,
        };
        let drag = if self.shift && drag == Drag::Along {
            Drag::Turn
        } else {
            drag
        };
        step(drag, across, upward, pointed, hold);
        true
    }

    fn move_between(
        &self,
        drag: Drag,
        from: (f64, f64),
        to: (f64, f64),
        pointed: &Pointed<'_>,
        hold: &mut Hold,
    ) {
        // Both ends belong to the view in which the drag is now.
        let Some((eye, part)) = view_at(pointed, from) else {
            return;
        };
        let [from, to] = [from, to].map(|at| place(pointed, &part, at));
        hold.drag(drag, pointed.screen, &eye, from, to);
    }
}

/// A step of a key or the wheel, in heights of the screen, from its middle.
fn step(drag: Drag, across: f64, upward: f64, pointed: &Pointed<'_>, hold: &mut Hold) {
    let eye = pointed.eyes.position(Eye::Middle);
    let aspect = pointed.screen.width() / pointed.screen.height();
    let middle = Place {
        across: 0.5,
        upward: 0.5,
    };
    let to = Place {
        across: 0.5 + across / aspect,
        upward: 0.5 + upward,
    };
    hold.drag(drag, pointed.screen, &eye, middle, to);
}

/// The eye whose view is under the mouse, and that view's part of the picture (x, y, width, height).
fn view_at(pointed: &Pointed<'_>, at: (f64, f64)) -> Option<(Point3<f64>, [f64; 4])> {
    let (x, y) = (at.0 / pointed.size.0, at.1 / pointed.size.1);
    let views = pointed.picture.views.iter().map(|(eye, part)| {
        let part = [part.x, part.y, part.width, part.height].map(f64::from);
        (pointed.eyes.position(*eye), part)
    });
    // A drag may leave the window: the nearest view goes on.
    let beyond = |[left, top, width, height]: &[f64; 4]| {
        let past = |at: f64, low: f64, high: f64| (low - at).max(at - high).max(0.0);
        past(x, *left, left + width) + past(y, *top, top + height)
    };
    views.min_by(|a, b| beyond(&a.1).total_cmp(&beyond(&b.1)))
}

/// The place on the screen that is drawn at a pixel of the window.
fn place(pointed: &Pointed<'_>, [left, top, width, height]: &[f64; 4], at: (f64, f64)) -> Place {
    Place {
        across: (at.0 / pointed.size.0 - left) / width,
        upward: 1.0 - (at.1 / pointed.size.1 - top) / height,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::Picture;
    use taut_proto::scene::Stereo;

    #[test]
    fn a_pixel_belongs_to_the_view_that_is_drawn_there() {
        let screen = Screen::from_corners(
            Point3::new(-0.9, 0.0, 0.0),
            Point3::new(0.9, 0.0, 0.0),
            Point3::new(-0.9, 0.0, 1.2),
        )
        .expect("a screen");
        let eyes = Eyes {
            left: Point3::new(-0.03, -1.0, 0.5),
            right: Point3::new(0.03, -1.0, 0.5),
        };
        let pictures = Picture::of(Stereo::SideBySide);
        let pointed = Pointed {
            screen: &screen,
            picture: &pictures[0],
            size: (1280.0, 400.0),
            eyes: &eyes,
        };
        for (at, eye, across) in [
            ((320.0, 100.0), eyes.left, 0.5),
            ((1120.0, 100.0), eyes.right, 0.75),
            ((1400.0, 100.0), eyes.right, 1.1875),
        ] {
            let (seen_by, part) = view_at(&pointed, at).expect("a view");
            assert_eq!(seen_by, eye);
            let place = place(&pointed, &part, at);
            assert!((place.across - across).abs() < 1e-12 && (place.upward - 0.75).abs() < 1e-12);
        }
    }

    #[test]
    fn the_button_that_began_a_drag_ends_it() {
        let mut mouse = Mouse::default();
        mouse.button(ElementState::Pressed, MouseButton::Left);
        mouse.button(ElementState::Pressed, MouseButton::Right);
        mouse.button(ElementState::Released, MouseButton::Left);
        assert_eq!(
            (mouse.drag, mouse.buttons()),
            (Some((Drag::Depth, MouseButton::Right)), 2)
        );
        mouse.button(ElementState::Released, MouseButton::Right);
        assert_eq!((mouse.drag, mouse.buttons()), (None, 0));
        mouse.modifiers(ModifiersState::SHIFT);
        mouse.button(ElementState::Pressed, MouseButton::Left);
        assert_eq!(mouse.drag, Some((Drag::Turn, MouseButton::Left)));
    }
}
