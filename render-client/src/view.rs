//! The viewer's eyes and the off-axis (generalised perspective) projection of one screen.
//!
//! | symbol     | name in code                              | unit | meaning                                  |
//! |------------|-------------------------------------------|------|------------------------------------------|
//! | pa, pb, pc | `lower_left`, `lower_right`, `upper_left` | m    | corners of the screen, workbench frame   |
//! | pe         | `eye`                                     | m    | one eye, workbench frame                 |
//! | vr, vu, vn | `right`, `up`, `normal`                   | –    | screen axes; `normal` is towards the eye |
//! | d          | `distance`                                | m    | from the eye to the plane of the screen  |
//! | l, r, b, t | `left` … `top`                            | m    | extents of the frustum on the near plane |
//! | n, f       | `near`, `far`                             | m    | clip planes, along `-normal`             |
//!
//! Two screens that share an edge show one continuous world, because each is the exact central
//! projection of the same points from the same eye.
//!
//! Source: Kooima 2009, "Generalized Perspective Projection"; depth mapped to [0, 1] as wgpu wants.

use nalgebra::{Isometry3, Matrix4, Point2, Point3, Vector3};
use thiserror::Error;

/// A flat screen in the workbench frame: wall, table or one side of a CAVE.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screen {
    lower_left: Point3<f64>,
    right: Vector3<f64>,
    up: Vector3<f64>,
    normal: Vector3<f64>,
    width: f64,
    height: f64,
}

/// Why three corners are not a screen.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ScreenError {
    /// A corner has a coordinate that is not finite.
    #[error("a corner of the screen is not a finite point; give three numbers in metres")]
    NotFinite,
    /// An edge is shorter than [`Screen::MIN_EDGE`].
    #[error("an edge of the screen is {edge:.6} m long; give corners at least 0.01 m apart")]
    TooSmall {
        /// Length of the edge, in metres.
        edge: f64,
    },
    /// The two edges are not at a right angle within [`Screen::SQUARENESS`].
    #[error(
        "the edges of the screen meet at {degrees:.2} degrees; give the lower left, lower right and upper left corners of a rectangle"
    )]
    NotSquare {
        /// The angle found, in degrees.
        degrees: f64,
    },
}

/// Positions of the two eyes in the workbench frame, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eyes {
    /// The left eye.
    pub left: Point3<f64>,
    /// The right eye.
    pub right: Point3<f64>,
}

/// Which eye a picture is drawn for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Eye {
    /// The point between the eyes.
    Middle,
    /// The left eye.
    Left,
    /// The right eye.
    Right,
}

/// Distances of the clip planes from the eye along the screen's normal, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlanes {
    /// Nothing nearer is drawn.
    pub near: f64,
    /// Nothing farther is drawn.
    pub far: f64,
}

impl Screen {
    /// Shortest edge of a screen, in metres: below it a declaration in the wrong unit is likelier.
    pub const MIN_EDGE: f64 = 0.01;
    /// Largest |cosine| between the edges: 0.5 degrees, more than a careful tape measure errs by.
    pub const SQUARENESS: f64 = 8.7e-3;
    /// An eye nearer to the plane than this, in metres, or behind it sees no picture.
    pub const MIN_EYE_DISTANCE: f64 = 1e-3;

    /// The rectangle with these corners; its visible side is where `right × up` points.
    ///
    /// The upper left corner is squared to the lower edge, so that the projection stays exact
    /// on the lower edge of a screen that was measured by hand.
    pub fn from_corners(
        lower_left: Point3<f64>,
        lower_right: Point3<f64>,
        upper_left: Point3<f64>,
    ) -> Result<Self, ScreenError> {
        let finite = |p: &Point3<f64>| p.iter().all(|x| x.is_finite());
        if !(finite(&lower_left) && finite(&lower_right) && finite(&upper_left)) {
            return Err(ScreenError::NotFinite);
        }
        let along = lower_right - lower_left;
        let upward = upper_left - lower_left;
        let width = along.norm();
        for edge in [width, upward.norm()] {
            let long_enough = edge >= Self::MIN_EDGE; // false for NaN from an overflow
            if !long_enough {
                return Err(ScreenError::TooSmall { edge });
            }
        }
        let cosine = along.dot(&upward) / (width * upward.norm());
        let square = cosine.abs() <= Self::SQUARENESS;
        if !square {
            let degrees = cosine.acos().to_degrees();
            return Err(ScreenError::NotSquare { degrees });
        }

        let right = along / width;
        let upright = upward - right * upward.dot(&right);
        let height = upright.norm();
        let up = upright / height;
        Ok(Self {
            lower_left,
            right,
            up,
            normal: right.cross(&up),
            width,
            height,
        })
    }

    /// Width of the screen, in metres.
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Height of the screen, in metres.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Unit vector to the viewer's right, along the lower edge.
    pub fn right(&self) -> Vector3<f64> {
        self.right
    }

    /// Unit vector up, along the left edge.
    pub fn up(&self) -> Vector3<f64> {
        self.up
    }

    /// Unit vector towards the viewer.
    pub fn normal(&self) -> Vector3<f64> {
        self.normal
    }

    /// The point of the screen at fractions of its width (from the left) and height (from below).
    pub fn point(&self, across: f64, upward: f64) -> Point3<f64> {
        self.lower_left + self.right * (across * self.width) + self.up * (upward * self.height)
    }

    /// Where a point is from the lower left corner, in metres: to the right, up, and towards the viewer.
    pub fn place(&self, point: &Point3<f64>) -> Vector3<f64> {
        let from = point - self.lower_left;
        Vector3::new(
            from.dot(&self.right),
            from.dot(&self.up),
            from.dot(&self.normal),
        )
    }

    /// The screen that lies parallel to this one, `towards` metres nearer to the viewer, and reaches from the one to the other place along each axis.
    pub fn part(&self, across: [f64; 2], upward: [f64; 2], towards: f64) -> Self {
        let [left, right] = across;
        let [bottom, top] = upward;
        debug_assert!(left < right && bottom < top);
        Self {
            lower_left: self.lower_left
                + self.right * left
                + self.up * bottom
                + self.normal * towards,
            width: right - left,
            height: top - bottom,
            ..*self
        }
    }

    /// Distance of `eye` from the plane of the screen, in metres, positive in front of it.
    pub fn distance(&self, eye: &Point3<f64>) -> f64 {
        (eye - self.lower_left).dot(&self.normal)
    }

    /// The map from the workbench frame to wgpu's clip space for this eye.
    ///
    /// `None` where the eye is behind the screen or nearer than [`Self::MIN_EYE_DISTANCE`].
    pub fn clip_from_workbench(
        &self,
        eye: &Point3<f64>,
        planes: &ClipPlanes,
    ) -> Option<Matrix4<f64>> {
        debug_assert!(0.0 < planes.near && planes.near < planes.far);
        let distance = self.distance(eye);
        let in_front = distance > Self::MIN_EYE_DISTANCE; // false for NaN: no picture
        if !in_front {
            return None;
        }

        // Kooima: extents of the screen as seen from the eye, scaled to the near plane.
        let to_corner = self.lower_left - eye;
        let ClipPlanes { near, far } = *planes;
        let scale = near / distance;
        let left = self.right.dot(&to_corner) * scale;
        let right = left + self.width * scale;
        let bottom = self.up.dot(&to_corner) * scale;
        let top = bottom + self.height * scale;

        #[rustfmt::skip]
        let clip_from_eye = Matrix4::new(
            2.0 * near / (right - left), 0.0, (right + left) / (right - left), 0.0,
            0.0, 2.0 * near / (top - bottom), (top + bottom) / (top - bottom), 0.0,
            0.0, 0.0, -far / (far - near), -far * near / (far - near),
            0.0, 0.0, -1.0, 0.0,
        );
        let (x, y, z) = (self.right, self.up, self.normal);
        let e = eye.coords;
        #[rustfmt::skip]
        let eye_from_workbench = Matrix4::new(
            x.x, x.y, x.z, -x.dot(&e),
            y.x, y.y, y.z, -y.dot(&e),
            z.x, z.y, z.z, -z.dot(&e),
            0.0, 0.0, 0.0, 1.0,
        );
        Some(clip_from_eye * eye_from_workbench)
    }
}

impl Eyes {
    /// The eyes of a head whose x axis runs from its left to its right ear.
    pub fn of_head(workbench_from_head: &Isometry3<f64>, separation: f64) -> Self {
        let half = 0.5 * separation;
        Self {
            left: workbench_from_head * Point3::new(-half, 0.0, 0.0),
            right: workbench_from_head * Point3::new(half, 0.0, 0.0),
        }
    }

    /// The position of one eye.
    pub fn position(&self, eye: Eye) -> Point3<f64> {
        match eye {
            Eye::Middle => nalgebra::center(&self.left, &self.right),
            Eye::Left => self.left,
            Eye::Right => self.right,
        }
    }
}

/// How large a picture shows things, for both eyes of it alike.
#[derive(Clone, Copy, Debug)]
pub struct Magnification {
    /// The middle of the eyes, workbench frame, and how far they are from it, m.
    eye: Point3<f64>,
    aside: f64,
    /// Unit vector along which depth counts, workbench frame.
    ahead: Vector3<f64>,
    /// Nothing nearer is drawn, m.
    near: f64,
    /// Distance of the screen from the eyes, m, times pixels for a metre of it.
    pixels: f64,
}

impl Magnification {
    /// Of a picture of `screen` that is so many pixels wide and high. The way in which they are smaller counts: two eyes side by side may halve the width.
    pub fn new(
        screen: &Screen,
        eyes: &Eyes,
        planes: &ClipPlanes,
        (width, height): (u32, u32),
    ) -> Self {
        let eye = eyes.position(Eye::Middle);
        let across = f64::from(width) / screen.width;
        let upward = f64::from(height) / screen.height;
        Self {
            eye,
            aside: (eyes.left - eye).norm(),
            ahead: -screen.normal,
            near: planes.near,
            pixels: screen.distance(&eye) * across.max(upward),
        }
    }

    /// The most pixels that a metre within a sphere can take, in whatever direction it lies: the norm of the derivative of `D p / depth`.
    pub fn most_pixels_per_metre(&self, center: &Point3<f64>, radius: f64) -> f64 {
        let away = center - self.eye;
        let around = radius + self.aside;
        let middle = away.dot(&self.ahead);
        let aside = (away - self.ahead * middle).norm() + around;
        let depth = (middle - around).max(self.near);
        self.pixels * depth.hypot(aside) / (depth * depth)
    }
}

/// Where a point of the workbench appears, in normalised device coordinates (right and up, ±1 at
/// the edges of the screen); `None` for a point that is not in front of the eye.
pub fn project(clip_from_workbench: &Matrix4<f64>, point: &Point3<f64>) -> Option<Point2<f64>> {
    let clip = clip_from_workbench * point.to_homogeneous();
    (clip.w > 0.0).then(|| Point2::new(clip.x / clip.w, clip.y / clip.w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};
    use proptest::prelude::*;

    /// Rounding of a few products of numbers near 1, in normalised device coordinates.
    const ROUNDING: f64 = 1e-9;
    const PLANES: ClipPlanes = ClipPlanes {
        near: 0.05,
        far: 20.0,
    };

    fn wall() -> Screen {
        Screen::from_corners(
            Point3::new(-0.9, 0.6, 0.0),
            Point3::new(0.9, 0.6, 0.0),
            Point3::new(-0.9, 0.6, 1.2),
        )
        .expect("a rectangle")
    }

    fn table() -> Screen {
        Screen::from_corners(
            Point3::new(-0.9, -0.6, 0.0),
            Point3::new(0.9, -0.6, 0.0),
            Point3::new(-0.9, 0.6, 0.0),
        )
        .expect("a rectangle")
    }

    prop_compose! {
        fn eye()(x in -2.0..2.0, y in -2.0..0.5, z in 0.1..2.0) -> Point3<f64> {
            Point3::new(x, y, z)
        }
    }

    proptest! {
        /// By the derivatives of the projection itself, about points of the sphere.
        #[test]
        fn nothing_is_larger_in_the_picture_than_the_magnification_says(
            eye in prop::array::uniform3(-0.5..0.5), center in prop::array::uniform3(-0.8..0.8),
            radius in 0.01..0.3, at in prop::array::uniform3(-1.0..1.0), along in prop::array::uniform3(-1.0..1.0),
            separation in 0.0..0.08, width in 100_u32..4000, height in 100_u32..4000,
        ) {
            let at = Vector3::from(at);
            let along = Vector3::from(along);
            prop_assume!(at.norm() <= 1.0 && along.norm() > 1e-3);
            let screen = Screen::from_corners([-0.9, 0.0, 0.0].into(), [0.9, 0.0, 0.0].into(), [-0.9, 0.0, 1.2].into())
                .expect("a rectangle");
            let head = Isometry3::translation(eye[0], eye[1] - 1.2, 0.6 + eye[2]);
            let eyes = Eyes::of_head(&head, separation);
            let planes = ClipPlanes { near: 0.05, far: 20.0 };
            let center = Point3::from(center);
            let sight = Magnification::new(&screen, &eyes, &planes, (width, height));
            let point = center + at * radius;
            let step = along.normalize() * 1e-6;
            for eye in [eyes.left, eyes.right] {
                let depth = screen.distance(&eye) - screen.place(&point).z;
                prop_assume!(depth >= planes.near);
                let clip = screen.clip_from_workbench(&eye, &planes).expect("in front");
                let pixel = |p: Point3<f64>| {
                    let place = project(&clip, &p).expect("in front").coords;
                    0.5 * place.component_mul(&nalgebra::Vector2::new(width.into(), height.into()))
                };
                let pixels = (pixel(point + step) - pixel(point - step)).norm() / (2.0 * step.norm());
                let most = sight.most_pixels_per_metre(&center, radius);
                prop_assert!(pixels <= most * (1.0 + 1e-6), "{pixels} of {most}");
            }
        }
    }

    proptest! {
        #[test]
        fn a_point_appears_where_its_line_of_sight_pierces_the_screen(
            eye in eye(), across in 0.0..=1.0f64, upward in 0.0..=1.0f64, beyond in 0.2..3.0f64,
        ) {
            for screen in [wall(), table()] {
                let clip = screen.clip_from_workbench(&eye, &PLANES).expect("in front");
                let point = eye + (screen.point(across, upward) - eye) * beyond;
                let seen = project(&clip, &point).expect("in front");
                prop_assert!((seen.x - (2.0 * across - 1.0)).abs() < ROUNDING);
                prop_assert!((seen.y - (2.0 * upward - 1.0)).abs() < ROUNDING);
            }
        }

        #[test]
        fn depth_runs_from_zero_at_the_near_plane_to_one_at_the_far_plane(eye in eye()) {
            let screen = wall();
            let clip = screen.clip_from_workbench(&eye, &PLANES).expect("in front");
            for (distance, depth) in [(PLANES.near, 0.0), (PLANES.far, 1.0)] {
                let seen = clip * (eye - screen.normal * distance).to_homogeneous();
                prop_assert!((seen.z / seen.w - depth).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn eyes_lie_on_the_x_axis_of_a_turned_head() {
        let quarter =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        let head = Isometry3::from_parts(Translation3::new(1.0, 2.0, 3.0), quarter);
        let eyes = Eyes::of_head(&head, 0.06);
        assert!((eyes.left - Point3::new(1.0, 1.97, 3.0)).norm() < ROUNDING);
        assert!((eyes.right - Point3::new(1.0, 2.03, 3.0)).norm() < ROUNDING);
        assert!((eyes.position(Eye::Middle) - Point3::new(1.0, 2.0, 3.0)).norm() < ROUNDING);
    }

    #[test]
    fn an_eye_behind_the_screen_or_nowhere_sees_nothing() {
        for eye in [Point3::new(0.0, 0.7, 0.5), Point3::new(0.0, f64::NAN, 0.5)] {
            assert!(wall().clip_from_workbench(&eye, &PLANES).is_none());
        }
    }

    #[test]
    fn corners_that_are_no_rectangle_are_refused() {
        let origin = Point3::origin();
        let x = Point3::new(1.0, 0.0, 0.0);
        let skew = Screen::from_corners(origin, x, Point3::new(0.5, 1.0, 0.0));
        assert!(matches!(skew, Err(ScreenError::NotSquare { .. })));
        let flat = Screen::from_corners(origin, x, origin);
        assert!(matches!(flat, Err(ScreenError::TooSmall { .. })));
        let nan = Screen::from_corners(origin, x, Point3::new(0.0, f64::NAN, 0.0));
        assert_eq!(nan, Err(ScreenError::NotFinite));
    }
}
