//! From a scene to what the method works on: meshes loaded or generated, masses, settings.

use std::ops::RangeInclusive;

use god_object::geometry::mass_properties;
use god_object::{Body, GodObject, Mesh, Obstacle, Settings, Texture, World};
use nalgebra::{Matrix3, Vector3};

use super::auto_fidelity::AutoFidelity;
use super::built::{BuiltHand, BuiltMotion, BuiltScene, GOD_OBJECT_NAME};
use super::load::{Scene, unusable};
use super::prepared::{Prepared, Source, Sources};
use super::spec::{MassSpec, ObstacleSpec, ReferencePoint, Shape};
use crate::check::MeshFigures;
use crate::document::At;
use crate::mesh_file::{FileLook, RawMesh};
use crate::problem::{FileError, Problem};
use crate::progress::Progress;
use crate::shapes;
use crate::simplify::{Simplified, simplify};

/// Masses of a body that a hand may hold, kg: the stiffness goes with them, and beyond these no number of the coupling means anything.
const MASSES: RangeInclusive<f64> = 1e-6..=1e6;

/// How finely an exact primitive is drawn: 5,120 triangles, 2,304, 288.
const DRAWN_SUBDIVISIONS: u32 = 4;
const DRAWN_MERIDIANS: usize = 48;
const DRAWN_SIDES: usize = 72;

impl Scene {
    /// Loads and generates the meshes and checks that the method can work on them. All faults are reported.
    pub fn build(&self) -> Result<BuiltScene, FileError> {
        self.build_from(None)
    }

    /// The same with the meshes of a scene that was built before, as far as they are the same.
    pub fn build_from(&self, before: Option<&Prepared>) -> Result<BuiltScene, FileError> {
        let mut problems = Vec::new();
        let spec = &self.spec;
        // What fidelity is chosen rests on the meshes as their files have them.
        let before = before.filter(|_| spec.fidelity.is_none());
        let mut sources = Vec::new();
        let mut made = |shape, at, problems: &mut _| {
            let (mesh, look, source) = self.mesh(shape, at, before, problems);
            sources.push(source);
            (mesh, look)
        };
        let held = &spec.god_object;
        let (mut body_mesh, body_look) = made(&held.shape, &held.shape_at, &mut problems);
        let (mut obstacle_meshes, looks): (Vec<Option<Mesh>>, Vec<FileLook>) = spec
            .obstacles
            .iter()
            .map(|o| made(&o.shape, &o.shape_at, &mut problems))
            .unzip();
        let mut scenery = self.built_scenery(&mut problems);
        let visuals = self.visuals(&mut problems);
        let environment = self.environment().unwrap_or_else(|problem| {
            problems.push(problem);
            None
        });
        let hand_path = self.hand_path().unwrap_or_else(|error| {
            problems.extend(error.into_problems());
            None
        });
        let motions = self.motions(&mut problems);
        let textures = self.textures(&obstacle_meshes, &mut problems);
        FileError::unless_empty(problems)?;
        let auto = match &body_mesh {
            Some(mesh) if spec.fidelity.is_some() => {
                let as_written = self.settings(longest_side(mesh), None)?;
                let hand = hand_path.as_ref();
                self.auto_fidelity(mesh, &obstacle_meshes, &as_written, hand, &motions)
            }
            _ => None,
        };
        let simplified = self.simplify_meshes(
            &mut body_mesh,
            &mut obstacle_meshes,
            auto.as_ref(),
            &mut sources,
        );

        let Some(mesh) = body_mesh else {
            return Err(self
                .document_start()
                .problem("has no god-object mesh")
                .into());
        };
        let size = longest_side(&mesh);
        let body = self.body(mesh)?;
        let settings = self.settings(size, auto.as_ref())?;
        if body
            .metric(settings.rotation_metric, &spec.god_object.pose)
            .is_none()
        {
            let text = "the mass or inertia of the god-object is out of range; check mass, density and the mesh's size (metres)";
            return Err(spec.god_object.at.problem(text).into());
        }
        let obstacles = self.built_obstacles(obstacle_meshes, textures, auto.as_ref(), &motions);
        let looks = [vec![body_look], looks].concat();
        let bodies = self.drawn_bodies((&body.mesh, &obstacles), &looks, visuals, &mut scenery);
        let hand = spec.hand.as_ref().zip(hand_path);
        let world = World { body, obstacles };
        GodObject::check_start(&world, &settings, &spec.god_object.pose)
            .map_err(|error| spec.god_object.at.problem(error.to_string()))?;
        Ok(BuiltScene {
            name: spec.name.clone(),
            world,
            settings,
            start: spec.god_object.pose,
            hand: hand.map(|(hand, path)| BuiltHand {
                path,
                repeat: hand.repeat,
                preset: hand.preset,
            }),
            motions,
            bodies,
            scenery: scenery.scenery,
            carried: scenery.carried,
            lost_looks: scenery.lost.into_iter().collect(),
            simplified,
            sources: Sources::new(sources),
            view: spec.view,
            environment,
            size,
            fidelity: auto.map(|auto| auto.plan),
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
            self.height_map(map, &o.shape, mesh)
                .map_err(|error| problems.extend(error.into_problems()))
                .ok()
        };
        self.spec.obstacles.iter().zip(meshes).map(of_one).collect()
    }

    /// Simplifies the meshes for which the scene asks for it, or the chosen fidelity does.
    fn simplify_meshes(
        &self,
        body: &mut Option<Mesh>,
        obstacles: &mut [Option<Mesh>],
        auto: Option<&AutoFidelity>,
        sources: &mut [Source],
    ) -> Vec<Simplified> {
        let spec = &self.spec;
        let obstacles = spec.obstacles.iter().zip(obstacles);
        std::iter::once((&spec.god_object.shape, GOD_OBJECT_NAME, body))
            .chain(obstacles.map(|(o, mesh)| (&o.shape, o.name.as_str(), mesh)))
            .zip(sources)
            .enumerate()
            .filter_map(|(index, ((shape, name, mesh), source))| {
                if source.simplified.is_none() {
                    let chosen = auto.and_then(|auto| auto.mesh_errors[index]);
                    source.simplified = simplify_as_asked(shape, chosen, name, mesh);
                }
                let report = source.simplified.clone()?;
                let body = name.to_owned();
                Some(Simplified { body, ..report })
            })
            .collect()
    }

    /// The obstacles of the world, those that move where their motion begins.
    fn built_obstacles(
        &self,
        meshes: Vec<Option<Mesh>>,
        textures: Vec<Option<Texture>>,
        auto: Option<&AutoFidelity>,
        motions: &[BuiltMotion],
    ) -> Vec<Obstacle> {
        let made = self.spec.obstacles.iter().zip(meshes).zip(textures);
        let mut obstacles: Vec<Obstacle> = made
            .enumerate()
            .filter_map(|(index, ((o, mesh), texture))| {
                let mut surface = o.surface.clone();
                if let Some(auto) = auto {
                    auto.shade(index, &mut surface);
                }
                surface.texture = surface.texture.or(texture);
                Some(Obstacle {
                    name: o.name.clone(),
                    mesh: mesh?,
                    primitive: o.shape.primitive(),
                    pose: o.pose,
                    surface,
                })
            })
            .collect();
        for motion in motions {
            obstacles[motion.obstacle].pose = motion.pose_at(0.0);
        }
        obstacles
    }

    /// Traces of the obstacles that move.
    fn motions(&self, problems: &mut Vec<Problem>) -> Vec<BuiltMotion> {
        let obstacles = self.spec.obstacles.iter().enumerate();
        let moving = obstacles.filter_map(|(index, o)| Some((index, o.motion.as_ref()?)));
        let mut motions = Vec::new();
        for (obstacle, motion) in moving {
            match self.trace(&motion.trace, &motion.at) {
                Ok(path) => motions.push(BuiltMotion {
                    obstacle,
                    path,
                    repeat: motion.repeat,
                }),
                Err(error) => problems.extend(error.into_problems()),
            }
        }
        motions
    }

    fn mesh(
        &self,
        shape: &Shape,
        at: &At,
        before: Option<&Prepared>,
        problems: &mut Vec<Problem>,
    ) -> (Option<Mesh>, FileLook, Source) {
        let (raw, look) = match self.raw_mesh(shape, at) {
            Ok(read) => read,
            Err(error) => {
                problems.extend(error.into_problems());
                return (None, FileLook::default(), Source::none());
            }
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

    fn body(&self, mesh: Mesh) -> Result<Body, FileError> {
        let spec = &self.spec.god_object;
        let primitive = spec.shape.primitive();
        let properties = primitive
            .and_then(|p| p.mass_properties())
            .unwrap_or_else(|| mass_properties(&mesh));
        let mass = match spec.mass {
            MassSpec::Mass(mass) => mass,
            MassSpec::Density(density) => density * properties.volume,
        };
        if !MASSES.contains(&mass) {
            let [least, most] = [MASSES.start(), MASSES.end()];
            let text = format!(
                "the god-object's mass comes to {mass:e} kg, which is not between {least:e} and {most:e}; check mass, density and scale"
            );
            return Err(spec.at.problem(text).into());
        }
        let reference_point = match spec.reference_point {
            ReferencePoint::CenterOfMass => properties.centroid,
            ReferencePoint::At(point) => point,
        };
        let about_centroid = properties.inertia_per_density * (mass / properties.volume);
        let inertia =
            about_centroid + displaced_inertia(mass, &(properties.centroid - reference_point));
        Ok(Body {
            mesh,
            primitive,
            mass,
            inertia,
            reference_point,
        })
    }

    /// Defaults for the body's size, then what was chosen for the scene, then `[coupling]`, `[limits]` and `[method]`.
    fn settings(&self, size: f64, auto: Option<&AutoFidelity>) -> Result<Settings, FileError> {
        let mut settings = Settings::for_size(size);
        if let Some(clearance) = self.spec.method.clearance {
            settings = settings.with_clearance(clearance);
        }
        let is_mesh = |shape: &Shape| shape.primitive().is_none();
        let obstacles = &self.spec.obstacles;
        let meshes_meet = is_mesh(&self.spec.god_object.shape)
            && obstacles.iter().any(|obstacle| is_mesh(&obstacle.shape));
        if !meshes_meet {
            settings = settings.for_exact_shapes();
        }
        if let Some(auto) = auto {
            settings.gap_tolerance = auto.gap_tolerance;
            settings.implicit_rounds = auto.rounds;
            // A budget of time is kept, not only hoped for.
            settings.work_budget = auto.plan.time_us.map(|time| time.ceil() as u64);
        }
        self.spec.coupling.pair(size).apply(&mut settings);
        self.spec.limits.apply(&mut settings);
        self.spec.method.apply(&mut settings);
        settings.validate().map_err(|error| {
            let text = format!("the settings for a body of {size} m do not fit together: {error}; check [coupling], [limits] and [method]");
            self.document_start().problem(text)
        })?;
        Ok(settings)
    }
}

fn longest_side(mesh: &Mesh) -> f64 {
    let [low, high] = mesh.bounding_box();
    (high - low).max()
}

/// Puts a simplified mesh in the place of the file's, if the shape asks for it or it was `chosen`, m.
fn simplify_as_asked(
    shape: &Shape,
    chosen: Option<f64>,
    name: &str,
    mesh: &mut Option<Mesh>,
) -> Option<Simplified> {
    let is_file = matches!(shape, Shape::Mesh { .. });
    let max_error = shape.simplify().or(chosen.filter(|_| is_file))?;
    let (coarser, report) = simplify(mesh.take()?, max_error, name);
    *mesh = Some(coarser);
    Some(report)
}

/// What a mass adds to the inertia about a point `offset` away (parallel axes).
fn displaced_inertia(mass: f64, offset: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * offset.norm_squared() - offset * offset.transpose()) * mass
}
