//! Materials of mesh files: which covers the most of a body, and what of the file's look is not drawn.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;

use taut_proto::Texture;
use taut_proto::mesh_blob::MAX_LOOKS;

use super::RawMesh;
use super::body_textures::{BodyTextures, Corners};
use super::mtl::read_library;
use super::picture_use::PictureUse;
use super::read::below;
use crate::appearance::Appearance;

/// Most materials that nobody defines which are named.
const MAX_UNDEFINED: usize = 3;

/// A hand's skin, that of a clay model, and the cloth of its cuff; a board's paper. Linear RGB.
const SKIN: [f32; 3] = [0.62, 0.47, 0.38];
const CLOTH: [f32; 3] = [0.035, 0.06, 0.12];
const PAPER: [f32; 3] = [0.83, 0.82, 0.79];

/// A material of a mesh file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Material {
    pub(super) name: String,
    pub(super) appearance: Appearance,
    /// Its colour is a factor on this.
    pub(super) picture: Option<PictureUse>,
    /// It names other pictures.
    pub(super) textured: bool,
    /// The file, or a library beside it, says what it looks like.
    pub(super) is_defined: bool,
}

/// The materials of a file, and which triangles are of which.
#[derive(Clone, Debug, Default)]
pub(super) struct Materials {
    pub(super) list: Vec<Material>,
    /// Lengths of runs of triangles, in the mesh's order, with the place of their material in `list`; `None` is none.
    pub(super) runs: Vec<(Option<usize>, usize)>,
    /// Where the triangles lie in pictures, by the file, v down; not finite where it does not say so. None where no material has a picture.
    pub(super) coordinates: Vec<Corners>,
    /// Files beside the mesh that say what materials look like, as the mesh names them.
    pub(super) libraries: Vec<String>,
    /// Vertices have colours of their own.
    pub(super) vertex_colours: bool,
    /// Faces have.
    pub(super) face_colours: bool,
    /// What is wrong with the libraries, as parts of a sentence.
    lost: Vec<String>,
    /// Some library could not be read.
    some_unread: bool,
}

/// How a mesh file says that its body looks.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FileLook {
    /// Of the material that covers the largest area.
    pub(crate) appearance: Appearance,
    /// Where they do not all look alike: lengths of runs of triangles, in the mesh's order, with how each looks.
    pub(crate) parts: Vec<(Appearance, usize)>,
    /// Textures of these parts.
    pub(crate) textures: Option<Arc<BodyTextures>>,
    /// What is lost where parts cannot be drawn, as a part of a sentence.
    pub(crate) merged: Option<String>,
    /// What else the file says and nobody draws, as parts of a sentence.
    pub(crate) lost: Vec<String>,
    /// A colour that a scene says is that of each part, and leaves its texture: of a shape whose parts are its own.
    keeps_parts: bool,
}

impl FileLook {
    /// The look of a hand: so many of its triangles are skin, the others the cuff.
    pub(crate) fn of_hand(skin: usize, all: usize) -> Self {
        let of = |color, roughness| Appearance {
            color: Some(color),
            roughness: Some(roughness),
            ..Appearance::default()
        };
        let parts = vec![(of(SKIN, 0.55), skin), (of(CLOTH, 0.95), all - skin)];
        Self {
            appearance: parts[0].0,
            parts,
            ..Self::default()
        }
    }

    /// The look of a board: its first two triangles show this, where the coordinates say.
    pub(crate) fn of_board(front: Texture, coordinates: Vec<Corners>) -> Self {
        let appearance = Appearance {
            color: Some(PAPER),
            roughness: Some(0.9),
            ..Appearance::default()
        };
        let others = coordinates.len().saturating_sub(2);
        Self {
            appearance,
            parts: vec![(appearance, 2), (appearance, others)],
            textures: Some(Arc::new(BodyTextures::of_one(front, coordinates))),
            keeps_parts: true,
            ..Self::default()
        }
    }

    /// How each run of the triangles of a drawn mesh looks where a scene says `said` of the body: empty where all look alike, as the scene says by
    /// a colour, or where the drawn triangles are not those of the file.
    pub(crate) fn drawn_parts(
        &self,
        said: &Appearance,
        drawn: &RawMesh,
    ) -> Vec<(Appearance, usize)> {
        let count: usize = self.parts.iter().map(|(_, count)| count).sum();
        let is_one = said.color.is_some() && !self.keeps_parts;
        if is_one || count != drawn.triangles.len() {
            return Vec::new();
        }
        let parts = self.parts.iter();
        parts
            .map(|(look, count)| (said.or(*look), *count))
            .collect()
    }

    /// The textures of these parts where they are drawn.
    pub(crate) fn drawn_textures(
        &self,
        said: &Appearance,
        drawn: &RawMesh,
    ) -> Option<Arc<BodyTextures>> {
        let is_drawn = !self.drawn_parts(said, drawn).is_empty();
        self.textures.clone().filter(|_| is_drawn)
    }

    /// What of it nobody sees where a scene says `said` of the body; `None` if nothing. A scene that names a colour has said what it wants.
    pub(crate) fn not_drawn(&self, said: &Appearance, drawn: &RawMesh) -> Option<String> {
        let unseen = said.opacity.is_none() && self.appearance.opacity == Some(0.0);
        let unseen = unseen.then_some("all of the body: by its file it has the opacity 0");
        let merged = self.merged.iter();
        let by_parts = !self.drawn_parts(said, drawn).is_empty();
        let others = (!by_parts && self.textures.is_some()).then(|| OTHER_TRIANGLES.to_owned());
        let merged = merged.filter(|_| !by_parts).chain(&others);
        let lost = merged.chain(&self.lost).filter(|_| said.color.is_none());
        let all: Vec<&str> = unseen.into_iter().chain(lost.map(String::as_str)).collect();
        (!all.is_empty()).then(|| all.join(", "))
    }
}

/// What is said of textures that are not drawn.
const OTHER_TRIANGLES: &str = "its textures: the triangles that are drawn are not those of the file; a `visual` of the same file shows them";

impl Materials {
    /// The next `triangles` of the mesh are of this material.
    pub(super) fn push(&mut self, material: Option<usize>, triangles: usize) {
        match self.runs.last_mut() {
            Some((last, count)) if *last == material => *count += triangles,
            _ => self.runs.push((material, triangles)),
        }
    }

    /// The place in the list of every triangle's material; empty of a format without materials.
    pub(super) fn of_triangles(&self) -> Vec<Option<usize>> {
        let runs = self.runs.iter();
        let each = runs.flat_map(|(material, count)| std::iter::repeat_n(*material, *count));
        each.collect()
    }

    /// The materials of some triangles alone, in this order; `of_triangles` are those of all.
    pub(super) fn some(&self, triangles: &[u32], of_triangles: &[Option<usize>]) -> Self {
        let wanted = || {
            triangles
                .iter()
                .filter_map(|t| of_triangles.get(*t as usize))
        };
        let used: BTreeSet<usize> = wanted().flatten().copied().collect();
        let places: HashMap<usize, usize> = used.iter().copied().zip(0..).collect();
        let coordinates = triangles.iter().map(|t| self.coordinates.get(*t as usize));
        let mut some = Self {
            list: used.iter().map(|place| self.list[*place].clone()).collect(),
            runs: Vec::new(),
            coordinates: coordinates.flatten().copied().collect(),
            libraries: Vec::new(),
            lost: self.lost.clone(),
            ..*self
        };
        for material in wanted() {
            some.push(material.map(|place| places[&place]), 1);
        }
        some
    }

    /// Reads the libraries that lie in `directory`.
    pub(super) fn read_libraries(&mut self, directory: Option<&Path>) {
        for library in std::mem::take(&mut self.libraries) {
            let inside = directory.zip(below(&library));
            let read = inside.map(|(directory, name)| {
                let folder = name.parent().unwrap_or(Path::new(""));
                read_library(&directory.join(&name), folder, &mut self.list)
            });
            self.some_unread |= !matches!(read, Some(Ok(_)));
            match read {
                Some(Ok(faults)) => self.lost.extend(faults),
                Some(Err(problem)) => self.lost.push(format!("its materials: {problem}")),
                None => self.lost.push(format!(
                    "its materials in `{library}`, which must lie beside it"
                )),
            }
        }
    }

    /// Whether a material has a picture.
    pub(super) fn have_pictures(&self) -> bool {
        self.list.iter().any(|material| material.picture.is_some())
    }

    /// Reads the pictures that lie in `directory`; then how a body of these triangles looks.
    pub(super) fn look(mut self, mesh: &RawMesh, directory: Option<&Path>) -> FileLook {
        let mut lost = std::mem::take(&mut self.lost);
        let areas = self.areas(mesh);
        let seen = |place: &usize| areas[*place] > 0.0;
        let places: Vec<usize> = (0..areas.len()).filter(seen).collect();
        // The first of several equal ones.
        let largest = places
            .iter()
            .copied()
            .reduce(|a, b| if areas[b] > areas[a] { b } else { a });
        let (factors, textures) = self.textures(mesh, &places, directory, &mut lost);
        let of = |place: usize| self.list.get(place).cloned().unwrap_or_default();
        let material = largest.map(of).unwrap_or_default();
        let others = places
            .iter()
            .filter(|place| !of(**place).looks_like(&material))
            .count();
        let merged = (others > 0).then(|| {
            format!(
                "{others} of its materials: all of the body has that of the largest area, \"{}\"",
                material.name
            )
        });
        let (mut parts, mut textured) = (Vec::new(), None);
        if (merged.is_some() || textures.is_some()) && places.len() <= MAX_LOOKS {
            (parts, textured) = self.parts(of, material.appearance.opacity, &factors, textures);
        }
        // A library that cannot be read is said above, and may define them.
        let undefined = places.iter().filter_map(|place| self.list.get(*place));
        let undefined = undefined.filter(|material| !self.some_unread && !material.is_defined);
        lost.extend(undefined.take(MAX_UNDEFINED).map(|material| {
            format!(
                "its material \"{}\", which no library defines",
                material.name
            )
        }));
        if places.iter().any(|place| of(*place).textured) {
            lost.push("its textures but those of colour".to_owned());
        }
        if self.vertex_colours {
            lost.push("its colours of vertices".to_owned());
        }
        if self.face_colours {
            lost.push("its colours of faces".to_owned());
        }
        FileLook {
            appearance: material.appearance,
            parts,
            textures: textured.map(Arc::new),
            merged,
            lost,
            keeps_parts: false,
        }
    }

    /// Area of each material of the list, m^2; of no material at the end.
    fn areas(&self, mesh: &RawMesh) -> Vec<f64> {
        let mut areas = vec![0.0; self.list.len() + 1];
        let mut triangles = mesh.triangles.iter();
        for (material, count) in &self.runs {
            let place = material.unwrap_or(self.list.len());
            for triangle in triangles.by_ref().take(*count) {
                let [a, b, c] = triangle.map(|corner| mesh.vertices[corner as usize]);
                areas[place] += 0.5 * (b - a).cross(&(c - a)).norm();
            }
        }
        areas
    }
}

impl Material {
    fn looks_like(&self, other: &Self) -> bool {
        self.appearance == other.appearance && self.picture == other.picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::cuboid;

    fn coloured(name: &str, red: f32) -> Material {
        let color = Some([red, 0.0, 0.0]);
        Material {
            name: name.to_owned(),
            appearance: Appearance {
                color,
                ..Appearance::default()
            },
            is_defined: true,
            ..Material::default()
        }
    }

    /// The look of a cube of twelve equal triangles.
    fn of(runs: &[(Option<usize>, usize)]) -> FileLook {
        let mut materials = Materials {
            list: vec![coloured("one", 0.1), coloured("two", 0.2)],
            ..Materials::default()
        };
        for (material, triangles) in runs {
            materials.push(*material, *triangles);
        }
        materials.look(&cuboid([1.0, 1.0, 1.0]), None)
    }

    #[test]
    fn the_material_of_the_largest_area_is_the_bodys() {
        let look = of(&[(Some(0), 5), (Some(1), 7)]);
        assert_eq!(look.appearance.color, Some([0.2, 0.0, 0.0]));
        let merged = "1 of its materials: all of the body has that of the largest area, \"two\"";
        assert_eq!(look.merged.as_deref(), Some(merged));
        // Each part looks as its own, unless the scene says how all of it looks, or the triangles are others.
        let cube = cuboid([1.0, 1.0, 1.0]);
        let [said, red] = [Appearance::default(), coloured("", 0.9).appearance];
        let counts = |parts: Vec<(Appearance, usize)>| -> Vec<_> {
            let red = |(look, count): &(Appearance, usize)| (look.color.map(|c| c[0]), *count);
            parts.iter().map(red).collect()
        };
        let drawn = counts(look.drawn_parts(&said, &cube));
        assert_eq!(drawn, [(Some(0.1), 5), (Some(0.2), 7)]);
        assert_eq!(look.not_drawn(&said, &cube), None);
        assert_eq!(look.drawn_parts(&red, &cube), []);
        let other = RawMesh {
            triangles: cube.triangles[1..].to_vec(),
            ..cube
        };
        assert_eq!(look.drawn_parts(&said, &other), []);
        assert_eq!(look.not_drawn(&said, &other).as_deref(), Some(merged));
        let look = of(&[(Some(0), 2), (Some(1), 5), (Some(0), 5)]);
        assert_eq!(look.appearance.color, Some([0.1, 0.0, 0.0]));
        // A part without a material counts as one that says nothing.
        assert_eq!(
            of(&[(None, 7), (Some(1), 5)]).appearance,
            Appearance::default()
        );
        assert_eq!(of(&[(Some(1), 12)]).lost, [""; 0]);
        assert_eq!(of(&[]), FileLook::default());
    }
}
