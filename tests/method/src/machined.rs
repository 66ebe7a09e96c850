//! Machine parts made in code: involute gears and screw threads, each a closed mesh.

use std::f64::consts::{PI, TAU};

use god_object::{Body, Obstacle, Pose};
use nalgebra::{Point3, Rotation2, Vector2, Vector3};
use taut_scene::RawMesh;

use crate::solids::{body, cells, mesh, obstacle};

/// Depth of the teeth of [`combs`], m.
pub const COMB_DEPTH: f64 = 10e-3;
/// Their pitch and width, and the thickness of the bars that they stand on, m.
const COMB_PITCH: f64 = 4e-3;
const COMB_TOOTH: f64 = 2e-3;
const COMB_BAR: f64 = 3e-3;

/// A comb of eleven teeth that point down, and one whose teeth go into the gaps of the other and beyond, so much narrower on each side, m.
/// Forces act in the middle of the teeth: a push to the side has no lever.
pub fn combs(clearance: f64) -> (Body, Obstacle) {
    let planes = |width: f64, teeth: usize| -> Vec<f64> {
        let first = -0.5 * (teeth - 1) as f64 * COMB_PITCH;
        (0..teeth)
            .flat_map(|k| {
                let middle = first + k as f64 * COMB_PITCH;
                [middle - 0.5 * width, middle + 0.5 * width]
            })
            .collect()
    };
    let y = [-5e-3, 5e-3];
    let upper_x = planes(COMB_TOOTH, 11);
    let upper = [&upper_x, &y[..], &[-COMB_DEPTH, 0.0, COMB_BAR]];
    let upper = cells(upper, |[i, _, k]| k == 1 || i % 2 == 0);
    let lower_x = planes(COMB_PITCH - COMB_TOOTH - 2.0 * clearance, 12);
    let lower = [&lower_x, &y[..], &[-COMB_BAR, 0.0, COMB_DEPTH]];
    let lower = cells(lower, |[i, _, k]| k == 0 || i % 2 == 0);
    let mut held = body(mesh(upper));
    held.reference_point = Point3::new(0.0, 0.0, -0.5 * COMB_DEPTH);
    (held, obstacle("comb", mesh(lower), Pose::identity()))
}

/// By how much half a tooth is wider at the root circle than at the base circle, rad.
const ROOT_WIDENING: f64 = 5e-3;

/// A spur gear with involute flanks about z.
#[derive(Clone, Copy, Debug)]
pub struct Gear {
    /// Pitch diameter per tooth, m.
    pub module: f64,
    /// How many teeth; from 18 on none is undercut.
    pub teeth: usize,
    /// Between the line of action and the tangent of the pitch circles, rad.
    pub pressure_angle: f64,
    /// By how much each flank is set back, measured along the pitch circle, m.
    pub set_back: f64,
    /// Half of its width along z, m.
    pub half_width: f64,
    /// Straight pieces of one flank.
    pub pieces: usize,
}

/// Gears of module 2 mm: 20 teeth, each flank set back by 0.1 mm along the pitch circle, against 40 that stand, and where these are.
///
/// Involutes stay parallel under rotation: the free play is 0.1 mm / 20 mm = 0.005 rad each way. Then the contact is a force along the line of
/// action, which touches the base circle r_b: turning on by d gives lambda = r_b d / (1/m + r_b^2 / I), torque k_h k_s r_b lambda.
pub fn gears(pieces: usize) -> (Gear, Gear, Pose) {
    let turning = Gear {
        module: 2e-3,
        teeth: 20,
        pressure_angle: 20.0_f64.to_radians(),
        set_back: 0.1e-3,
        half_width: 5e-3,
        pieces,
    };
    let standing = Gear {
        teeth: 40,
        set_back: 0.0,
        half_width: 8e-3,
        ..turning
    };
    // A gap between two teeth faces the tooth at x.
    let place = Pose::new(
        Vector3::new(turning.pitch_radius() + standing.pitch_radius(), 0.0, 0.0),
        Vector3::z() * (PI + PI / standing.teeth as f64),
    );
    (turning, standing, place)
}

impl Gear {
    /// m.
    pub fn pitch_radius(&self) -> f64 {
        0.5 * self.module * self.teeth as f64
    }

    /// Of the circle whose involutes the flanks are, m.
    pub fn base_radius(&self) -> f64 {
        self.pitch_radius() * self.pressure_angle.cos()
    }

    /// The gear, one tooth in the direction of x.
    pub fn mesh(&self) -> RawMesh {
        let outline = self.outline();
        let count = outline.len();
        let mut raw = RawMesh::default();
        for z in [-self.half_width, self.half_width] {
            raw.vertices
                .extend(outline.iter().map(|p| Point3::new(p.x, p.y, z)));
        }
        // Seen from the axis every point of the outline is in sight: fans close the ends.
        let (bottom, top) = (2 * count as u32, 2 * count as u32 + 1);
        raw.vertices.push(Point3::new(0.0, 0.0, -self.half_width));
        raw.vertices.push(Point3::new(0.0, 0.0, self.half_width));
        for i in 0..count {
            let (a, b) = (i as u32, ((i + 1) % count) as u32);
            let (c, d) = (a + count as u32, b + count as u32);
            raw.triangles
                .extend([[a, b, d], [a, d, c], [bottom, b, a], [top, c, d]]);
        }
        raw
    }

    /// Anticlockwise.
    fn outline(&self) -> Vec<Vector2<f64>> {
        let (pitch, base) = (self.pitch_radius(), self.base_radius());
        let (root, tip) = (pitch - 1.25 * self.module, pitch + self.module);
        let involute = |angle: f64| angle.tan() - angle;
        // Half of the angle that a tooth takes at this radius.
        let at_pitch = PI / (2.0 * self.teeth as f64) - self.set_back / pitch;
        let half_angle = |radius: f64| {
            let pressure = (base / radius).min(1.0).acos();
            at_pitch + involute(self.pressure_angle) - involute(pressure)
        };
        // Wider at the root: no point of the outline hides behind another, seen from the axis.
        let mut flank = vec![(root, half_angle(base) + ROOT_WIDENING)];
        for piece in 0..=self.pieces {
            let radius = base + (tip - base) * piece as f64 / self.pieces as f64;
            flank.push((radius, half_angle(radius)));
        }
        let polar =
            |radius: f64, angle: f64| Vector2::new(radius * angle.cos(), radius * angle.sin());
        let mut outline = Vec::new();
        for tooth in 0..self.teeth {
            let turn = Rotation2::new(TAU * tooth as f64 / self.teeth as f64);
            let rising = flank.iter().map(|&(radius, half)| polar(radius, -half));
            let falling = flank
                .iter()
                .rev()
                .map(|&(radius, half)| polar(radius, half));
            outline.extend(rising.chain(falling).map(|point| turn * point));
        }
        outline
    }
}

/// A right-handed screw thread of 60 degrees about z: its ridges are sampled so that vertices lie on helices.
#[derive(Clone, Copy, Debug)]
pub struct Thread {
    /// Outer radius of the bolt, m.
    pub major_radius: f64,
    /// Advance per turn, m.
    pub pitch: f64,
    /// Straight pieces per turn, and samples of the ridge per pitch.
    pub facets: usize,
}

impl Thread {
    /// Rise of the flanks: radius over length, tan 60 degrees.
    pub const SLOPE: f64 = 1.732_050_807_568_877_2;

    /// Height of the ridges, m.
    pub fn depth(&self) -> f64 {
        // 17/24 of the height of the sharp triangle.
        17.0 / 24.0 * 0.5 * Self::SLOPE * self.pitch
    }

    /// The bolt, from z = 0 on.
    pub fn bolt(&self, turns: usize) -> RawMesh {
        let (mut raw, rings) = self.ridged(turns, 0.0);
        let facets = self.facets as u32;
        let last = facets * (rings as u32 - 1);
        let height = turns as f64 * self.pitch;
        let bottom = raw.vertices.len() as u32;
        raw.vertices
            .extend([Point3::origin(), Point3::new(0.0, 0.0, height)]);
        for i in 0..facets {
            let next = (i + 1) % facets;
            raw.triangles
                .extend([[bottom, next, i], [bottom + 1, last + i, last + next]]);
        }
        raw
    }

    /// A nut from z = 0 on, whose thread is `clearance` wider, m, and whose outside is a cylinder of `outer_radius`, m.
    pub fn nut(&self, turns: usize, clearance: f64, outer_radius: f64) -> RawMesh {
        let (mut raw, rings) = self.ridged(turns, clearance);
        raw.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let facets = self.facets as u32;
        let last = facets * (rings as u32 - 1);
        let below = raw.vertices.len() as u32;
        for z in [0.0, turns as f64 * self.pitch] {
            raw.vertices
                .extend((0..self.facets).map(|i| self.at(i, outer_radius, z)));
        }
        let above = below + facets;
        for i in 0..facets {
            let next = (i + 1) % facets;
            raw.triangles.extend([
                [below + i, below + next, above + next],
                [below + i, above + next, above + i],
                [below + i, i, next],
                [below + i, next, below + next],
                [above + i, last + next, last + i],
                [above + i, above + next, last + next],
            ]);
        }
        raw
    }

    /// The ridged surface seen from outside, `wider` than the bolt's, m, and how many rings it has.
    fn ridged(&self, turns: usize, wider: f64) -> (RawMesh, usize) {
        let facets = self.facets;
        let rings = turns * facets + 1;
        let mut raw = RawMesh::default();
        for ring in 0..rings {
            let z = ring as f64 * self.pitch / facets as f64;
            raw.vertices.extend((0..facets).map(|i| {
                let phase = (ring + facets - i) % facets;
                self.at(i, self.radius(phase) + wider, z)
            }));
        }
        let vertex = |ring: usize, i: usize| (ring * facets + i % facets) as u32;
        for ring in 0..rings - 1 {
            for i in 0..facets {
                // Along the helix, so that each strip is of one height of the ridge.
                let (a, b) = (vertex(ring, i), vertex(ring, i + 1));
                let (c, d) = (vertex(ring + 1, i), vertex(ring + 1, i + 1));
                raw.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        (raw, rings)
    }

    fn at(&self, facet: usize, radius: f64, z: f64) -> Point3<f64> {
        let angle = TAU * facet as f64 / self.facets as f64;
        Point3::new(radius * angle.cos(), radius * angle.sin(), z)
    }

    /// Of the bolt at this sample of the ridge: a flat crest of an eighth of the pitch, flanks, a flat root.
    fn radius(&self, phase: usize) -> f64 {
        let along = (phase as f64 / self.facets as f64 - 0.5).abs() * self.pitch;
        let fallen = (along - self.pitch / 16.0).max(0.0) * Self::SLOPE;
        self.major_radius - fallen.min(self.depth())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::mesh;
    use god_object::geometry::mass_properties;

    #[test]
    fn a_gear_is_closed_and_fills_about_its_pitch_circle() {
        let gear = Gear {
            module: 2e-3,
            teeth: 20,
            pressure_angle: 20.0_f64.to_radians(),
            set_back: 0.0,
            half_width: 5e-3,
            pieces: 24,
        };
        let volume = mass_properties(&mesh(gear.mesh())).volume;
        let disc = PI * gear.pitch_radius().powi(2) * 2.0 * gear.half_width;
        assert!((volume / disc - 1.0).abs() < 0.05, "{volume} {disc}");
    }

    #[test]
    fn bolt_and_nut_are_closed_and_leave_the_clearance_between_them() {
        let thread = Thread {
            major_radius: 5e-3,
            pitch: 1.5e-3,
            facets: 64,
        };
        let (outer, clearance, turns) = (8e-3, 0.2e-3, 2);
        let bolt = mass_properties(&mesh(thread.bolt(turns))).volume;
        let nut = mass_properties(&mesh(thread.nut(turns, clearance, outer))).volume;
        let height = turns as f64 * thread.pitch;
        // The polygon of 64 corners instead of the circle.
        let polygon = 32.0 * (TAU / 64.0).sin();
        let whole = polygon * outer * outer * height;
        let gap = whole - nut - bolt;
        let mean_radius = thread.major_radius - 0.5 * thread.depth();
        let expected = TAU * (mean_radius + 0.5 * clearance) * clearance * height;
        assert!((gap / expected - 1.0).abs() < 0.05, "{gap} {expected}");
    }
}
