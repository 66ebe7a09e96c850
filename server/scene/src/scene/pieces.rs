//! What a scene is built of: its meshes, loaded or generated, and what its other files hold.

use god_object::{Mesh, Texture};
use taut_proto::Panorama;

use super::built::BuiltMotion;
use super::drawn::{Drawn, SceneryList};
use super::load::{Scene, unusable};
use super::prepared::{Prepared, Source};
use super::spec::{ObstacleSpec, Shape};
use crate::check::MeshFigures;
use crate::document::At;
use crate::mesh_file::{FileLook, RawMesh};
use crate::problem::{FileError, Problem};
use crate::progress::Progress;
use crate::shapes;
use crate::trace::DeviceTrace;

/// How finely an exact primitive is drawn: 5,120 triangles, 2,304, 288.
const DRAWN_SUBDIVISIONS: u32 = 4;
const DRAWN_MERIDIANS: usize = 48;
const DRAWN_SIDES: usize = 72;

/// The pieces of a scene. Lists have one entry for each obstacle, in order; some begin with the god-object's.
pub(super) struct Pieces<'s> {
    pub(super) body: Option<Mesh>,
    pub(super) obstacles: Vec<Option<Mesh>>,
    /// The god-object's first, as in `sources` and `visuals`.
    pub(super) looks: Vec<FileLook>,
    pub(super) sources: Vec<Source>,
    pub(super) scenery: SceneryList,
    pub(super) visuals: Vec<Option<Drawn<'s>>>,
    pub(super) environment: Option<Panorama>,
    pub(super) hand_path: Option<DeviceTrace>,
    /// Only of obstacles that move.
    pub(super) motions: Vec<BuiltMotion>,
    pub(super) textures: Vec<Option<Texture>>,
}

impl Scene {
    /// Reads and generates all, but for meshes that are as `before`. Every fault is reported.
    pub(super) fn pieces(&self, before: Option<&Prepared>) -> Result<Pieces<'_>, FileError> {
        let mut problems = Vec::new();
        let spec = &self.spec;
        // What fidelity is chosen rests on the meshes as their files have them.
        let before = before.filter(|_| spec.fidelity.is_none());
        let (mut looks, mut sources) = (Vec::new(), Vec::new());
        let mut made = |shape, at, problems: &mut _| {
            let (mesh, look, source) = self.mesh(shape, at, before, problems);
            looks.push(look);
            sources.push(source);
            mesh
        };
        let held = &spec.god_object;
        let body = made(&held.shape, &held.shape_at, &mut problems);
        let obstacles = spec.obstacles.iter();
        let obstacles: Vec<Option<Mesh>> = obstacles
            .map(|o| made(&o.shape, &o.shape_at, &mut problems))
            .collect();
        let scenery = self.built_scenery(&mut problems);
        let visuals = self.visuals(&mut problems);
        let environment = FileError::noted(self.environment(), &mut problems).flatten();
        let hand_path = FileError::noted(self.hand_path(), &mut problems).flatten();
        let motions = self.motions(&mut problems);
        let textures = self.textures(&obstacles, &mut problems);
        FileError::unless_empty(problems)?;
        Ok(Pieces {
            body,
            obstacles,
            looks,
            sources,
            scenery,
            visuals,
            environment,
            hand_path,
            motions,
            textures,
        })
    }

    /// The height maps of the obstacles that have one.
    fn textures(
        &self,
        meshes: &[Option<Mesh>],
        problems: &mut Vec<Problem>,
    ) -> Vec<Option<Texture>> {
        let of_one = |(o, mesh): (&ObstacleSpec, &Option<Mesh>)| {
            let map = o.height_map.as_ref()?;
            let Some(mesh) = mesh else {
                // Told with what is wrong with the mesh: one run tells everything.
                problems.extend(self.height_map_file(map).err());
                return None;
            };
            FileError::noted(self.height_map(map, &o.shape, mesh), problems)
        };
        self.spec.obstacles.iter().zip(meshes).map(of_one).collect()
    }

    /// Traces of the obstacles that move.
    fn motions(&self, problems: &mut Vec<Problem>) -> Vec<BuiltMotion> {
        let obstacles = self.spec.obstacles.iter().enumerate();
        let moving = obstacles.filter_map(|(index, o)| Some((index, o.motion.as_ref()?)));
        let built = moving.filter_map(|(obstacle, motion)| {
            let path = FileError::noted(self.trace(&motion.trace, &motion.at), problems)?;
            let repeat = motion.repeat;
            Some(BuiltMotion {
                obstacle,
                path,
                repeat,
            })
        });
        built.collect()
    }

    fn mesh(
        &self,
        shape: &Shape,
        at: &At,
        before: Option<&Prepared>,
        problems: &mut Vec<Problem>,
    ) -> (Option<Mesh>, FileLook, Source) {
        let Some((raw, look)) = FileError::noted(self.raw_mesh(shape, at), problems) else {
            return (None, FileLook::default(), Source::default());
        };
        let mut source = Source::of(&raw, shape.simplify());
        if let Some(mesh) = before.and_then(|before| before.take_over(&mut source)) {
            return (Some(mesh), look, source);
        }
        let (count, name) = (raw.triangles.len(), shape.file().unwrap_or("a shape"));
        let _progress =
            Progress::on_triangles(count, format_args!("{name}: preparing {count} triangles"));
        let mesh = Mesh::new(raw.vertices, raw.triangles)
            .map_err(|error| {
                let Shape::Mesh { path, .. } = shape else {
                    problems.push(at.problem(format!("the shape cannot be used: {error}")));
                    return;
                };
                // Made again, since no copy is kept of a mesh that is sound: all its faults, with their places.
                let (raw, _) = self.raw_mesh(shape, at).unwrap_or_default();
                let faults = MeshFigures::of(&raw).faults();
                problems.extend(faults.iter().map(|fault| unusable(at, path, fault)));
                if faults.is_empty() {
                    problems.push(unusable(at, path, error));
                }
            })
            .ok();
        (mesh, look, source)
    }

    /// The surface of a shape of this scene, not yet checked for being closed, and how its file says that it looks.
    pub(super) fn raw_mesh(
        &self,
        shape: &Shape,
        at: &At,
    ) -> Result<(RawMesh, FileLook), FileError> {
        let mesh = match *shape {
            Shape::Mesh {
                ref path,
                ref only,
                scale,
                ..
            } => {
                let (mesh, look) = self.mesh_file(path, only, at)?;
                return Ok((mesh.scaled(scale), look));
            }
            Shape::Sphere {
                radius,
                subdivisions,
            } => shapes::sphere(radius, subdivisions.unwrap_or(DRAWN_SUBDIVISIONS)),
            Shape::Box { half_extents } => shapes::cuboid(half_extents),
            Shape::Capsule {
                radius,
                half_length,
                facets,
                axis,
            } => shapes::capsule(radius, half_length, facets.unwrap_or(DRAWN_MERIDIANS), axis),
            Shape::Cylinder {
                radius,
                half_length,
                facets,
                axis,
            } => shapes::cylinder(radius, half_length, facets.unwrap_or(DRAWN_SIDES), axis),
            Shape::BoxWithHole {
                half_extents,
                radius,
                facets,
                axis,
            } => shapes::box_with_hole(half_extents, radius, facets, axis),
            Shape::Plane { plate, axis } => {
                let [size, thickness] = plate.unwrap_or(shapes::PLATE);
                shapes::plane(size, thickness, axis)
            }
            Shape::Hand { length, is_left } => {
                let (mesh, of_skin) = shapes::hand(length, is_left);
                let look = FileLook::of_hand(of_skin, mesh.triangles.len());
                return Ok((mesh, look));
            }
            Shape::Board { ref text, width } => {
                let board = shapes::board(text, width)
                    .ok_or_else(|| at.problem("the board's text does not fit; write less"))?;
                let look = FileLook::of_board(board.front, board.coordinates);
                return Ok((board.mesh, look));
            }
        };
        Ok((mesh, FileLook::default()))
    }
}
