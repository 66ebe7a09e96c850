//! What is drawn of a scene: bodies by their forms or instead of them, and what is only seen.

use std::collections::BTreeSet;

use god_object::{Mesh, Obstacle, Pose};

use super::built::{BuiltBody, Carried, GOD_OBJECT_NAME};
use super::load::Scene;
use super::opacities::by_opacity;
use super::spec::{Carrier, Shape, VisualSpec};
use crate::appearance::Appearance;
use crate::mesh_file::{FileLook, RawMesh};
use crate::problem::{FileError, Problem};

/// What is only seen: the scene's own, in its order, and then parts of bodies that are drawn beside them.
#[derive(Debug, Default)]
pub(super) struct SceneryList {
    pub(super) scenery: Vec<BuiltBody>,
    pub(super) carried: Vec<Carried>,
    /// What is lost of looks, a sentence for each file.
    pub(super) lost: BTreeSet<String>,
}

impl SceneryList {
    /// Adds what goes where its carrier goes, at a pose from there; without one it stands.
    fn add(&mut self, body: BuiltBody, carrier: Option<(Carrier, Pose)>) {
        if let Some((by, pose)) = carrier {
            let place = self.scenery.len();
            self.carried.push(Carried { place, by, pose });
        }
        self.scenery.push(body);
    }
}

/// What is drawn of a body: form, mesh and look.
pub(super) type Drawn<'s> = (&'s Shape, RawMesh, FileLook);

impl Scene {
    /// God-object and obstacles as they are drawn. Their parts of another opacity are bodies of their own, which go where they go.
    pub(super) fn drawn_bodies(
        &self,
        (body, obstacles): (&Mesh, &[Obstacle]),
        looks: &[FileLook],
        visuals: Vec<Option<Drawn<'_>>>,
        scenery: &mut SceneryList,
    ) -> Vec<BuiltBody> {
        let of = &self.spec.god_object;
        let carrier = Some(Carrier::GodObject);
        let held = (GOD_OBJECT_NAME, of.pose, &of.appearance);
        let held = (held, (&of.shape, body), carrier);
        let obstacles = obstacles.iter().zip(&self.spec.obstacles).enumerate();
        let obstacles = obstacles.map(|(place, (obstacle, of))| {
            let carrier = of.motion.as_ref().map(|_| Carrier::Obstacle(place));
            let named = (obstacle.name.as_str(), obstacle.pose, &of.appearance);
            (named, (&of.shape, &obstacle.mesh), carrier)
        });
        let all = std::iter::once(held).chain(obstacles);
        let mut bodies = Vec::new();
        for (((named, (shape, mesh), carrier), look), visual) in all.zip(looks).zip(visuals) {
            let (shape, mesh, look) =
                visual.unwrap_or_else(|| (shape, RawMesh::from(mesh), look.clone()));
            let mut parts = drawn(named, (shape, mesh, look), &mut scenery.lost).into_iter();
            bodies.extend(parts.next());
            let carrier = carrier.map(|by| (by, Pose::identity()));
            parts.for_each(|part| scenery.add(part, carrier));
        }
        bodies
    }

    /// What is drawn of bodies instead of their forms; the god-object first.
    pub(super) fn visuals<'s>(&'s self, problems: &mut Vec<Problem>) -> Vec<Option<Drawn<'s>>> {
        let obstacles = self.spec.obstacles.iter().map(|o| &o.visual);
        let all = std::iter::once(&self.spec.god_object.visual).chain(obstacles);
        let mut read = |visual: Option<&'s VisualSpec>| {
            let VisualSpec { shape, at } = visual?;
            let read = FileError::noted(self.raw_mesh(shape, at), problems);
            read.map(|(mesh, look)| (shape, mesh, look))
        };
        all.map(|visual| read(visual.as_ref())).collect()
    }

    /// The scene's scenery.
    pub(super) fn built_scenery(&self, problems: &mut Vec<Problem>) -> SceneryList {
        let (mut scenery, mut others) = (SceneryList::default(), Vec::new());
        for spec in &self.spec.scenery {
            let read = self.raw_mesh(&spec.shape, &spec.shape_at);
            let Some((mesh, look)) = FileError::noted(read, problems) else {
                continue;
            };
            let carrier = spec.carrier.map(|by| (by, spec.pose));
            let pose = match carrier {
                Some(_) => self.spec.god_object.pose * spec.pose,
                None => spec.pose,
            };
            let named = (spec.name.as_str(), pose, &spec.appearance);
            let mut parts = drawn(named, (&spec.shape, mesh, look), &mut scenery.lost).into_iter();
            if let Some(part) = parts.next() {
                scenery.add(part, carrier);
            }
            others.extend(parts.map(|part| (part, carrier)));
        }
        others
            .into_iter()
            .for_each(|(part, carrier)| scenery.add(part, carrier));
        scenery
    }
}

/// A body as it is drawn: one for each opacity of its looks. What is lost of the look of its file goes to `lost`.
fn drawn(
    (name, pose, said): (&str, Pose, &Appearance),
    (shape, mesh, look): Drawn<'_>,
    lost: &mut BTreeSet<String>,
) -> Vec<BuiltBody> {
    let of_file = shape.file().zip(look.not_drawn(said, &mesh));
    lost.extend(
        of_file.map(|(file, lost)| format!("of the look of \"{file}\" is not drawn: {lost}")),
    );
    by_opacity(BuiltBody {
        name: name.to_owned(),
        looks: look.drawn_parts(said, &mesh),
        textures: look.drawn_textures(said, &mesh),
        mesh,
        pose,
        appearance: said.or(look.appearance),
    })
}
