//! What a node draws, as plain data: screens, viewer, bodies with their meshes.
//!
//! Two frames are in use. Bodies move in the **scene** frame of the simulation; screens and eyes
//! live in the **workbench** frame. `workbench_from_scene` places one in the other and may enlarge
//! it: a scene of a hand's size fills a workbench of two metres.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Similarity3};
use taut_proto::scene::Stereo;
use taut_proto::{Finish, Looks};

use crate::calibration::Chart;
use crate::comfort::Comfort;
use crate::correction::Correction;
use crate::environment::Environment;
use crate::textures::MeshTextures;
use crate::view::{ClipPlanes, Screen};

/// Everything that stays the same over a session.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Screens of this node.
    pub screens: Vec<StageScreen>,
    /// Where the viewer's head is while no tracker says so, workbench frame.
    pub head: Isometry3<f64>,
    /// Distance between the viewer's eyes, in metres.
    pub eye_separation: f64,
    /// How stereo is eased.
    pub comfort: Comfort,
    /// What is nearer to the eye or farther from it than these is not drawn.
    pub clip_planes: ClipPlanes,
    /// Places the scene on the workbench.
    pub workbench_from_scene: Similarity3<f64>,
    /// Meshes, each named by its place in this list.
    pub meshes: Vec<Arc<TriangleMesh>>,
    /// The body in the user's hand.
    pub god_object: StageBody,
    /// Where the force on the hand applies, in the god-object's body frame.
    pub reference_point: Point3<f64>,
    /// All others.
    pub obstacles: Vec<StageBody>,
    /// The light around them.
    pub environment: Arc<Environment>,
}

/// One screen of a node.
#[derive(Clone, Debug)]
pub struct StageScreen {
    /// Name, unique on the node.
    pub name: String,
    /// Where it stands.
    pub screen: Screen,
    /// Pixels of one eye's view, across and down.
    pub pixels: (u32, u32),
    /// How it shows two eyes.
    pub stereo: Stereo,
    /// What is done to its pictures; `None` shows them as they are drawn.
    pub correction: Option<Arc<Correction>>,
    /// Drawn instead of the scene, by `taut calibrate`, and only where there is a correction. Of two the first is the left eye's.
    pub charts: Vec<Arc<Chart>>,
}

/// A body to draw.
#[derive(Clone, Copy, Debug)]
pub struct StageBody {
    /// Id by which states name it.
    pub id: u16,
    /// Place of its mesh in [`Stage::meshes`].
    pub mesh: usize,
    /// Size of the body over that of its mesh.
    pub scale: f64,
    /// Where its mesh's origin lies, in metres, body frame: near the mesh, whose coordinates are single precision.
    pub origin: Point3<f64>,
    /// Pose at the start, scene frame.
    pub pose: Isometry3<f64>,
    /// Linear red, green and blue in [0, 1].
    pub colour: [f32; 3],
    /// 0 is not drawn, 1 hides what is behind it; below 1 it casts no shadow.
    pub opacity: f32,
    /// How its surface reflects; `None` is as bodies of its kind do.
    pub finish: Option<Finish>,
}

/// Vertices and triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// In metres, body frame.
    pub vertices: Vec<[f32; 3]>,
    /// Three places in `vertices` each.
    pub triangles: Vec<[u32; 3]>,
    /// How triangles look that do not look as the body does.
    pub looks: Option<Looks>,
    /// Textures of these looks.
    pub textures: Option<Arc<MeshTextures>>,
}

/// A sphere around something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its centre, in metres.
    pub center: Point3<f64>,
    /// Its radius, in metres.
    pub radius: f64,
}

impl StageScreen {
    /// What is drawn instead of the scene in the picture at this place among those of the screen.
    pub fn chart(&self, picture: usize) -> Option<&Chart> {
        let chart = self.charts.get(picture).or(self.charts.first());
        chart.map(|chart| &**chart)
    }

    /// Whether a place of a picture is not where it was drawn.
    pub fn is_warped(&self) -> bool {
        let correction = self.correction.as_ref();
        correction.is_some_and(|correction| !correction.meshes.is_empty())
    }
}

impl TriangleMesh {
    /// Lowest and highest coordinates, body frame; both the origin for an empty mesh.
    pub fn corners(&self) -> (Point3<f64>, Point3<f64>) {
        let points = self.vertices.iter().map(|v| Point3::from(*v).cast::<f64>());
        let boxes = points.map(|p| (p, p));
        let around = boxes.reduce(|(low, high), (p, q)| (low.inf(&p), high.sup(&q)));
        around.unwrap_or_default()
    }

    /// Sphere around the middle of the mesh's box, body frame.
    pub fn bounds(&self) -> Bounds {
        let (low, high) = self.corners();
        let center = nalgebra::center(&low, &high);
        let far = |v: &[f32; 3]| (Point3::from(*v).cast::<f64>() - center).norm();
        let radius = self.vertices.iter().map(far).fold(0.0, f64::max);
        Bounds { center, radius }
    }
}

impl Stage {
    /// Sphere around a body at `pose` (scene frame), in the workbench frame, from that of its mesh.
    pub fn body_bounds(&self, body: &StageBody, pose: &Isometry3<f64>, mesh: &Bounds) -> Bounds {
        let Bounds { center, radius } = *mesh;
        Bounds {
            center: self.workbench_from_scene * (pose * body.place(&center)),
            radius: radius * body.scale * self.workbench_from_scene.scaling(),
        }
    }
}

impl StageBody {
    /// A point of the mesh in the body's frame.
    pub fn place(&self, point: &Point3<f64>) -> Point3<f64> {
        self.origin + point.coords * self.scale
    }
}

impl Bounds {
    /// A sphere around both.
    pub fn union(&self, other: &Self) -> Self {
        let apart = (other.center - self.center).norm();
        if apart + other.radius <= self.radius {
            return *self;
        }
        if apart + self.radius <= other.radius {
            return *other;
        }
        let radius = 0.5 * (apart + self.radius + other.radius);
        let toward = (other.center - self.center) / apart; // apart > 0: neither holds the other
        Self {
            center: self.center + toward * (radius - self.radius),
            radius,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_union_holds_both_spheres(
            x in -1.0..1.0f64, y in -1.0..1.0f64, a in 0.0..1.0f64, b in 0.0..1.0f64,
        ) {
            let one = Bounds { center: Point3::origin(), radius: a };
            let two = Bounds { center: Point3::new(x, y, 0.5), radius: b };
            let both = one.union(&two);
            for part in [one, two] {
                prop_assert!((part.center - both.center).norm() + part.radius <= both.radius + 1e-12);
            }
        }
    }
}
