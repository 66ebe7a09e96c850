//! From a scene to what the method works on: masses, settings, what is drawn.

use std::ops::RangeInclusive;

use god_object::geometry::mass_properties;
use god_object::{Body, GodObject, Mesh, Obstacle, Settings, Texture, World};
use nalgebra::{Matrix3, Vector3};

use super::auto_fidelity::AutoFidelity;
use super::built::{BuiltHand, BuiltMotion, BuiltScene, GOD_OBJECT_NAME};
use super::load::Scene;
use super::pieces::Pieces;
use super::prepared::{Prepared, Sources};
use super::spec::{MassSpec, ReferencePoint, Shape};
use crate::problem::FileError;
use crate::simplify::{Simplified, simplify};

/// Masses of a body that a hand may hold, kg: the stiffness goes with them, and beyond these no number of the coupling means anything.
const MASSES: RangeInclusive<f64> = 1e-6..=1e6;

impl Scene {
    /// Loads and generates the meshes and checks that the method can work on them. All faults are reported.
    pub fn build(&self) -> Result<BuiltScene, FileError> {
        self.build_from(None)
    }

    /// The same with the meshes of a scene that was built before, as far as they are the same.
    pub fn build_from(&self, before: Option<&Prepared>) -> Result<BuiltScene, FileError> {
        let (spec, start) = (&self.spec, self.spec.god_object.pose);
        let mut pieces = self.pieces(before)?;
        let auto = self.chosen_fidelity(&pieces)?;
        let simplified = self.simplify_meshes(&mut pieces, auto.as_ref());
        let Some(mesh) = pieces.body else {
            let none = self.document_start().problem("has no god-object mesh");
            return Err(none.into());
        };
        let size = longest_side(&mesh);
        let body = self.body(mesh)?;
        let settings = self.settings(size, auto.as_ref())?;
        if body.metric(settings.rotation_metric, &start).is_none() {
            let text = "the mass or inertia of the god-object is out of range; check mass, density and the mesh's size (metres)";
            return Err(spec.god_object.at.problem(text).into());
        }
        let (motions, mut scenery) = (pieces.motions, pieces.scenery);
        let made = (pieces.obstacles, pieces.textures);
        let obstacles = self.built_obstacles(made, auto.as_ref(), &motions);
        let touched = (&body.mesh, &obstacles[..]);
        let bodies = self.drawn_bodies(touched, &pieces.looks, pieces.visuals, &mut scenery);
        let hand = spec.hand.as_ref().zip(pieces.hand_path);
        let world = World { body, obstacles };
        GodObject::check_start(&world, &settings, &start)
            .map_err(|error| spec.god_object.at.problem(error.to_string()))?;
        Ok(BuiltScene {
            name: spec.name.clone(),
            world,
            settings,
            start,
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
            sources: Sources(pieces.sources),
            view: spec.view,
            environment: pieces.environment,
            size,
            fidelity: auto.map(|auto| auto.plan),
        })
    }

    /// The fidelity of a scene that leaves the choice to the program.
    fn chosen_fidelity(&self, pieces: &Pieces<'_>) -> Result<Option<AutoFidelity>, FileError> {
        let mesh = pieces.body.as_ref();
        let Some(mesh) = mesh.filter(|_| self.spec.fidelity.is_some()) else {
            return Ok(None);
        };
        let as_written = self.settings(longest_side(mesh), None)?;
        let hand = pieces.hand_path.as_ref();
        Ok(self.auto_fidelity(mesh, &pieces.obstacles, &as_written, hand, &pieces.motions))
    }

    /// Simplifies the meshes for which the scene asks for it, or the chosen fidelity does.
    fn simplify_meshes(
        &self,
        pieces: &mut Pieces<'_>,
        auto: Option<&AutoFidelity>,
    ) -> Vec<Simplified> {
        let spec = &self.spec;
        let obstacles = spec.obstacles.iter().zip(&mut pieces.obstacles);
        std::iter::once((&spec.god_object.shape, GOD_OBJECT_NAME, &mut pieces.body))
            .chain(obstacles.map(|(o, mesh)| (&o.shape, o.name.as_str(), mesh)))
            .zip(&mut pieces.sources)
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
        (meshes, textures): (Vec<Option<Mesh>>, Vec<Option<Texture>>),
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
