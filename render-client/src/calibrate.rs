//! Calibration pictures of the screens of a node, without a server: as PNG files or in its windows.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Point3;
use taut_proto::mesh_blob::Positions;
use taut_proto::scene::BodyDescription;
use taut_proto::scene::Show;
use taut_proto::{MeshBlob, MeshHash, PoseF64, SceneDescription};

use crate::calibration::Chart;
use crate::canvas::Canvas;
use crate::description::{self, Overrides};
use crate::error::RenderError;
use crate::headless::picture_file;
use crate::preview::at_start;
use crate::renderer::{Gpu, GpuChoice};
use crate::stage::Stage;
use crate::window::still;

/// Size of the body that the scene of a calibration has and that is not drawn, m.
const SIZE: f64 = 0.01;

/// The screens of one node.
#[derive(Clone, Debug)]
pub struct Calibration {
    node: String,
    stage: Stage,
}

/// Which windows show it.
#[derive(Clone, Debug, Default)]
pub struct CalibrationWindows {
    /// Without frames, over whole monitors.
    pub fullscreen: bool,
    /// Monitors in the order of the windows, by name or number; empty takes what the description says.
    pub monitors: Vec<String>,
    /// The graphics adapter.
    pub gpu: GpuChoice,
}

impl Calibration {
    /// The node of this name, of a workbench that was described for nodes; its files are in `folder`.
    pub fn new(
        workbench: &SceneDescription,
        node: &str,
        folder: &Path,
    ) -> Result<Self, RenderError> {
        let found = description::find_node(workbench, node)?;
        let overrides = Overrides {
            headless: true,
            pictures: true, // as large as the windows are
            screen_files: folder.to_path_buf(),
            ..Overrides::default()
        };
        let mesh = Arc::new(speck()?);
        let meshes = vec![mesh; 1 + workbench.obstacles.len()];
        let mut stage = description::stage(
            workbench,
            found,
            (&meshes, &HashMap::new()),
            None,
            &overrides,
        )?;
        for screen in &mut stage.screens {
            let correction = screen.correction.take().unwrap_or_default();
            // An output lights its own part of the screen: where there is one for each eye, each has a picture of its own.
            let chart = |picture: usize| {
                let mesh = correction.mesh(picture);
                Arc::new(Chart::new(
                    &screen.name,
                    &screen.screen,
                    screen.pixels,
                    &mesh,
                ))
            };
            screen.charts = (0..correction.meshes.len().max(1)).map(chart).collect();
            screen.correction = Some(correction);
        }
        Ok(Self {
            node: node.to_owned(),
            stage,
        })
    }

    /// The body of a scene in which nothing is drawn.
    pub fn body() -> BodyDescription {
        BodyDescription {
            name: "nothing".into(),
            mesh: MeshHash { bytes: [0; 32] },
            pose: PoseF64::IDENTITY,
            colour: [0.0; 4],
        }
    }

    /// File name (node, screen, and eye where it has a picture of its own) and bytes of each picture, as PNG.
    pub fn pictures(&self, gpu: Gpu) -> Result<Vec<(PathBuf, Vec<u8>)>, RenderError> {
        let mut canvas = Canvas::new(gpu, self.stage.clone())?;
        canvas.draw(&at_start(&self.stage), Show::default(), true)?;
        let images = canvas.images()?;
        let png = |(name, image): (&str, image::RgbaImage)| {
            let mut bytes = Cursor::new(Vec::new());
            image
                .write_to(&mut bytes, image::ImageFormat::Png)
                .map_err(|error| canvas.gpu().broken(&error))?;
            let name = picture_file(&self.node, &format!("{name}.png"));
            Ok((name.into(), bytes.into_inner()))
        };
        images.into_iter().map(png).collect()
    }

    /// Shows the pictures in the node's windows until Esc, a closed window or a signal. Wants the main thread.
    pub fn show(&self, windows: &CalibrationWindows) -> Result<(), RenderError> {
        still::show(&self.in_windows(), &self.node, windows)
    }

    /// The stage for windows, which are as large as the picture; files are measured by one eye's view.
    fn in_windows(&self) -> Stage {
        let mut stage = self.stage.clone();
        for screen in &mut stage.screens {
            screen.pixels = screen.stereo.picture_size(screen.pixels);
        }
        stage
    }
}

/// A triangle.
fn speck() -> Result<MeshBlob, RenderError> {
    let corners = [[0.0, 0.0], [SIZE, 0.0], [0.0, SIZE]];
    let points = corners.map(|[x, y]| Point3::new(x, y, 0.0).into());
    MeshBlob::new(Positions::F64(points.to_vec()), vec![[0, 1, 2]], None).map_err(|error| {
        RenderError::BadScene {
            what: error.to_string(),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_proto::scene::{
        NodeDescription, OutputDescription, ScreenDescription, Stereo, WindowDescription,
    };

    fn workbench(stereo: Stereo, output: OutputDescription) -> SceneDescription {
        let mut workbench = SceneDescription::of_body("nothing", Calibration::body());
        workbench.screens.push(ScreenDescription {
            name: "front".into(),
            lower_left: [-0.9, 0.0, 0.0],
            lower_right: [0.9, 0.0, 0.0],
            upper_left: [-0.9, 0.0, 1.2],
            output,
        });
        workbench.nodes.push(NodeDescription {
            name: "wall".into(),
            screens: vec!["front".into()],
            stereo,
            window: WindowDescription {
                width: 1920,
                height: 1080,
                fullscreen: false,
            },
            monitors: Vec::new(),
        });
        workbench
    }

    /// Points of the wall between two places along it, as a map of two by two.
    fn part_of_the_wall(from: f32, to: f32) -> Vec<u8> {
        let across = [0.25, 0.75].map(|share| from + share * (to - from));
        let points = [0.3_f32, 0.9].map(|z| across.map(|x| [x, 0.0, z]));
        let values = points.into_iter().flatten().flatten();
        let header = b"PF\n2 2\n-1.0\n".iter().copied();
        header.chain(values.flat_map(f32::to_le_bytes)).collect()
    }

    #[test]
    fn each_eye_s_output_has_the_picture_of_the_part_that_it_lights() {
        let folder = tempfile::tempdir().expect("a folder");
        let lit = [("left.pfm", -0.9, 0.5), ("right.pfm", -0.5, 0.9)];
        for (name, from, to) in lit {
            let written = std::fs::write(folder.path().join(name), part_of_the_wall(from, to));
            written.expect("written");
        }
        let output = OutputDescription {
            surface: vec!["left.pfm".into(), "right.pfm".into()],
            ..OutputDescription::default()
        };
        let workbench = workbench(Stereo::TwoWindows, output);
        let calibration = Calibration::new(&workbench, "wall", folder.path()).expect("a node");
        for (picture, (_, from, to)) in lit.into_iter().enumerate() {
            let chart = calibration.stage.screens[0].chart(picture);
            let quads = chart.expect("a picture").quads().iter();
            // Without letters, which may stand beyond the edge.
            let filled = quads.filter(|quad| quad.letter.is_none());
            let places = filled.flat_map(|quad| quad.corners.map(|corner| corner.x));
            let ends = places.fold((0.0_f64, 0.0_f64), |(low, high), x| {
                (low.min(x), high.max(x))
            });
            // Lines along the edges are a few pixels of 0.7 mm wide.
            let off = (ends.0 - f64::from(from)).abs() + (ends.1 - f64::from(to)).abs();
            assert!(off < 0.02, "{ends:?} of {from} to {to}");
        }
    }

    #[test]
    fn windows_are_as_large_as_the_workbench_file_says_in_any_stereo_mode() {
        for (_, stereo) in Stereo::NAMED {
            let workbench = workbench(stereo, OutputDescription::default());
            let calibration = Calibration::new(&workbench, "wall", Path::new(""));
            let stage = calibration.expect("a node").in_windows();
            assert_eq!(stage.screens[0].pixels, (1920, 1080), "{stereo:?}");
        }
    }
}
