//! How the picture of a screen is corrected for what shows it: warp, surface, blend mask, colour.
//!
//! The scene is drawn off-screen by the projection of [`crate::view`]; one pass brings that picture to the output, triangle by triangle
//! of a mesh ([`taut_screens::OutputMesh`]). A node of the mesh says where it is in the output, and what shines there: a place of the flat screen, or a
//! point of a curved surface. A point is projected by the same eye's view that drew the scene, in each frame, so that it shows what the eye sees
//! behind it, wherever the head is. A flat screen is the surface that lies in the plane of the picture: the same pass, with a projection that does not depend on
//! the eye.
//!
//! Source: Raskar, Welch, Cutts, Lake, Stesin, Fuchs 1998, "The Office of the Future"; Raskar 1999, "Immersive planar display using roughly aligned
//! projectors": two-pass rendering with projective textures.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Matrix3, Matrix4, Point3, Vector3};
use taut_proto::Untrusted;
use taut_proto::scene::OutputDescription;
use taut_screens::{
    Fault, MAX_TANGENT, Mask, OutputMesh, Target, file_name_fault, read_blend, read_surface,
    read_warp,
};

use crate::error::RenderError;
use crate::view::{ClipPlanes, Screen};

/// Cells of the boxes around a surface, each way: the picture is drawn as large as they look.
const BOXES: usize = 16;

/// What is done to the pictures of one screen. Of two meshes or masks the first is of the left eye's picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// Where everything goes; none is the whole picture over the whole output.
    pub meshes: Vec<Arc<OutputMesh>>,
    /// The light that each pixel keeps; none keeps all.
    pub masks: Vec<Arc<Mask>>,
    /// Names of the files of `masks`, for people; none where they are of no file.
    pub mask_files: Vec<String>,
    /// Light sent for light wanted, linear red, green and blue.
    pub colour: Matrix3<f64>,
    /// Exponents of the responses of red, green and blue, light over signal; 0 is that of sRGB.
    pub gamma: Vector3<f64>,
    /// Pixels drawn for a pixel of the output, each way.
    pub sampling: f64,
}

impl Default for Correction {
    /// The picture as it is drawn.
    fn default() -> Self {
        Self {
            meshes: Vec::new(),
            masks: Vec::new(),
            mask_files: Vec::new(),
            colour: Matrix3::identity(),
            gamma: Vector3::zeros(),
            sampling: 1.0,
        }
    }
}

impl Correction {
    /// What the workbench file says, with its files from `folder`; `None` where it says nothing. `aspect`: width over height of
    /// the window that it asks for; the one that opens may have another.
    pub fn read(
        described: &OutputDescription,
        folder: &Path,
        aspect: f64,
    ) -> Result<Option<Self>, RenderError> {
        if *described == OutputDescription::default() {
            return Ok(None);
        }
        let warps = each(&described.warp, folder, &["pfm", "data"], |path| {
            read_warp(path, aspect)
        })?;
        let surfaces = each(&described.surface, folder, &["pfm"], read_surface)?;
        Ok(Some(Self {
            // The workbench file has one of the two.
            meshes: if surfaces.is_empty() { warps } else { surfaces },
            masks: each(&described.blend, folder, &["png", "pfm"], |path| {
                read_blend(path, described.blend_gamma)
            })?,
            mask_files: described.blend.iter().map(Untrusted::to_string).collect(),
            colour: Matrix3::from_row_slice(&described.colour),
            gamma: Vector3::from(described.gamma),
            sampling: described.sampling,
        }))
    }

    /// Whether it changes what colours mean.
    pub fn corrects_colour(&self) -> bool {
        self.colour != Matrix3::identity() || self.gamma != Vector3::zeros()
    }

    /// The mesh of the picture at this place among those of the screen.
    pub fn mesh(&self, picture: usize) -> Arc<OutputMesh> {
        let mesh = self.meshes.get(picture).or(self.meshes.first());
        mesh.map_or_else(|| OutputMesh::identity().into(), Arc::clone)
    }

    /// The mask of the picture at this place among those of the screen.
    pub fn mask(&self, picture: usize) -> Option<&Arc<Mask>> {
        self.masks.get(picture).or(self.masks.first())
    }
}

/// Reads files, at most one for each eye.
fn each<T>(
    names: &[Untrusted],
    folder: &Path,
    endings: &[&str],
    read: impl Fn(&Path) -> Result<T, Fault>,
) -> Result<Vec<Arc<T>>, RenderError> {
    let refused = |what: String| RenderError::ScreenFile { what };
    let one = |name: &Untrusted| {
        // A name that leaves the folder is refused here too: the file is read on this machine.
        if let Some(fault) = file_name_fault(name.raw(), endings) {
            return Err(refused(fault));
        }
        let read = read(&folder.join(name.raw()));
        read.map(Arc::new)
            .map_err(|fault| refused(fault.to_string()))
    };
    names.iter().take(2).map(one).collect()
}

/// Boxes that together hold a surface: what a picture must reach to hold all of it.
#[derive(Clone, Debug)]
pub struct Hull {
    /// Corners of the boxes, m, workbench frame.
    corners: Vec<Point3<f64>>,
}

impl Hull {
    /// Of the nodes of a mesh; `None` if that is a warp of a flat screen.
    pub fn of(mesh: &OutputMesh) -> Option<Self> {
        if mesh.target != Target::Surface {
            return None;
        }
        let mut corners = Vec::new();
        let (wide, high) = (
            mesh.columns.div_ceil(BOXES).max(2),
            mesh.rows.div_ceil(BOXES).max(2),
        );
        // Neighbours share nodes, so that what lies between them is held, too.
        for row in (0..mesh.rows - 1).step_by(high - 1) {
            for column in (0..mesh.columns - 1).step_by(wide - 1) {
                let (right, top) = (
                    (column + wide).min(mesh.columns),
                    (row + high).min(mesh.rows),
                );
                let all = (row..top).flat_map(|r| (column..right).map(move |c| (c, r)));
                let points = all.map(|(c, r)| Point3::from(mesh.node(c, r).target).cast::<f64>());
                let boxes = points.map(|p| (p, p));
                let around = boxes.reduce(|(low, high), (p, q)| (low.inf(&p), high.sup(&q)));
                let (low, high) = around.unwrap_or_default();
                let corner = |i: usize| {
                    let of = |axis: usize| {
                        if i >> axis & 1 == 0 {
                            low[axis]
                        } else {
                            high[axis]
                        }
                    };
                    Point3::new(of(0), of(1), of(2))
                };
                corners.extend((0..8).map(corner));
            }
        }
        Some(Self { corners })
    }

    /// The flat screen, parallel to `screen`, that holds the surface as each of the eyes sees it. It touches the surface's far end, and
    /// is the same for all eyes, so that text in it has one place.
    pub fn screen(&self, screen: &Screen, eyes: &[Point3<f64>]) -> Screen {
        let places: Vec<Vector3<f64>> = self.corners.iter().map(|p| screen.place(p)).collect();
        let behind = places.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        let (mut low, mut high) = (
            Vector3::repeat(f64::INFINITY),
            Vector3::repeat(f64::NEG_INFINITY),
        );
        for eye in eyes.iter().map(|eye| screen.place(eye)) {
            let distance = eye.z - behind;
            let reach = MAX_TANGENT * distance;
            if reach.is_nan() || reach <= 0.0 {
                continue; // behind the surface: sees nothing of it
            }
            for place in &places {
                let ahead = (eye.z - place.z).max(1e-3 * distance);
                let pierced = eye + (place - eye) * (distance / ahead);
                let within = pierced.zip_map(&eye, |p, e| p.clamp(e - reach, e + reach));
                (low, high) = (low.inf(&within), high.sup(&within));
            }
        }
        if low.x < high.x && low.y < high.y {
            screen.part([low.x, high.x], [low.y, high.y], behind)
        } else {
            *screen
        }
    }
}

/// The map from what a mesh's nodes show to the clip space of the picture that was drawn for `eye`; `None` where it sees nothing.
pub fn clip_from_target(
    target: Target,
    screen: &Screen,
    eye: &Point3<f64>,
    planes: &ClipPlanes,
) -> Option<Matrix4<f64>> {
    match target {
        #[rustfmt::skip]
        Target::Picture => Some(Matrix4::new(
            2.0, 0.0, 0.0, -1.0,
            0.0, 2.0, 0.0, -1.0,
            0.0, 0.0, 1.0, 0.0,
            0.0, 0.0, 0.0, 1.0,
        )),
        Target::Surface => screen.clip_from_workbench(eye, planes),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::view::project;
    use taut_screens::{Across, OutputNode};

    const PLANES: ClipPlanes = ClipPlanes {
        near: 0.02,
        far: 20.0,
    };

    /// A surface that is lit at these points, by shares of the output.
    pub(crate) fn surface(
        (columns, rows): (usize, usize),
        target: impl Fn(f32, f32) -> [f32; 3],
    ) -> OutputMesh {
        let node = |i: usize| {
            let s = (i % columns) as f32 / (columns - 1) as f32;
            let t = (i / columns) as f32 / (rows - 1) as f32;
            OutputNode {
                place: [s, t],
                target: target(s, t),
                share: 1.0,
            }
        };
        OutputMesh {
            target: Target::Surface,
            across: Across::Width,
            columns,
            rows,
            nodes: (0..columns * rows).map(node).collect(),
        }
    }

    /// A quarter of a cylinder of 1.2 m around the z axis, 1 m high, seen from within.
    fn cylinder() -> OutputMesh {
        surface((65, 5), |s, t| {
            let angle = (s - 0.5) * std::f32::consts::FRAC_PI_2;
            [1.2 * angle.sin(), 1.2 * angle.cos(), t]
        })
    }

    #[test]
    fn the_picture_holds_the_whole_surface_for_every_eye_and_wastes_little() {
        let mesh = cylinder();
        let hull = Hull::of(&mesh).expect("a surface");
        let screen = Screen::from_corners(
            Point3::new(-0.8, 0.8, 0.0),
            Point3::new(0.8, 0.8, 0.0),
            Point3::new(-0.8, 0.8, 1.0),
        );
        let screen = screen.expect("a screen");
        for eye in [
            [0.0, 0.0, 0.5],
            [0.4, -0.5, 0.9],
            [-0.3, 0.55, 0.4],
            [0.0, 0.68, 0.5],
        ] {
            let eye = Point3::from(eye);
            let fitted = hull.screen(&screen, &[eye]);
            let clip = fitted.clip_from_workbench(&eye, &PLANES).expect("in front");
            let mut reach = 0.0_f64;
            for node in &mesh.nodes {
                let point = Point3::from(node.target).cast();
                let seen = project(&clip, &point).expect("in front");
                assert!(
                    seen.x.abs() <= 1.0 + 1e-6 && seen.y.abs() <= 1.0 + 1e-6,
                    "{seen}"
                );
                reach = reach.max(seen.x.abs());
            }
            assert!(reach > 0.9, "{reach} of the picture is used from {eye}");
        }
    }

    #[test]
    fn an_eye_behind_or_nowhere_leaves_the_screen_as_it_is() {
        let hull = Hull::of(&cylinder()).expect("a surface");
        let corners = [[-0.8, 0.8, 0.0], [0.8, 0.8, 0.0], [-0.8, 0.8, 1.0]].map(Point3::from);
        let screen = Screen::from_corners(corners[0], corners[1], corners[2]).expect("a screen");
        for eye in [[0.0, 3.0, 0.5], [f64::NAN, 0.0, 0.0]] {
            let fitted = hull.screen(&screen, &[Point3::from(eye)]);
            assert!(
                fitted
                    .clip_from_workbench(&Point3::from(eye), &PLANES)
                    .is_none()
            );
        }
        assert!(Hull::of(&OutputMesh::identity()).is_none());
    }

    #[test]
    fn files_outside_of_the_folder_are_not_read_whatever_the_server_says() {
        let described = OutputDescription {
            surface: vec!["../../etc/passwd.pfm".into()],
            ..OutputDescription::default()
        };
        let folder = tempfile::tempdir().expect("a folder");
        let error = Correction::read(&described, folder.path(), 1.5).expect_err("refused");
        assert!(error.to_string().contains("within the folder"), "{error}");
        let none = Correction::read(&OutputDescription::default(), folder.path(), 1.5);
        assert_eq!(none.expect("nothing to read"), None);
    }
}
