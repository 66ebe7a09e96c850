//! The nodes of a glTF scene: where they are and what they are called.

use nalgebra::Matrix4;

use super::Fault;

/// A node of the tree, and where it is.
pub(super) struct Placed<'f> {
    pub(super) node: gltf::Node<'f>,
    pub(super) world_from_node: Matrix4<f64>,
    pub(super) depth: usize,
    /// Names of the nodes that it hangs below.
    names_above: Vec<String>,
}

impl<'f> Placed<'f> {
    pub(super) fn root(node: gltf::Node<'f>) -> Self {
        Self {
            world_from_node: transform(&node),
            node,
            depth: 0,
            names_above: Vec::new(),
        }
    }

    pub(super) fn children(&self) -> impl Iterator<Item = Self> {
        let mut names_above = self.names_above.clone();
        names_above.extend(self.node.name().map(str::to_owned));
        self.node.children().map(move |child| Self {
            world_from_node: self.world_from_node * transform(&child),
            node: child,
            depth: self.depth + 1,
            names_above: names_above.clone(),
        })
    }

    /// Its own, else its mesh's, else its number; then its mesh's and those above.
    pub(super) fn names(&self) -> Vec<String> {
        let mesh = self.node.mesh();
        let of_mesh = mesh.as_ref().and_then(gltf::Mesh::name);
        let own = self.node.name().or(of_mesh).map(str::to_owned);
        let mut names = vec![own.unwrap_or_else(|| format!("node {}", self.node.index()))];
        names.extend(of_mesh.map(str::to_owned));
        names.extend(self.names_above.iter().cloned());
        names
    }
}

fn transform(node: &gltf::Node<'_>) -> Matrix4<f64> {
    Matrix4::from(node.transform().matrix()).cast::<f64>()
}

/// Refuses vertices that are not where the mesh has them.
pub(super) fn posed_as_it_is(node: &gltf::Node<'_>, mesh: &gltf::Mesh<'_>) -> Result<(), Fault> {
    let number = mesh.index();
    if is_morphed(node, mesh) {
        return Err(Fault::new(format!(
            "mesh {number} has morph targets with weights, which are not applied; apply its shape keys, and export it without morph targets"
        )));
    }
    if node.skin().is_some() {
        return Err(Fault::new(format!(
            "mesh {number} has a skin, which is not applied; apply the armature, and export it again"
        )));
    }
    Ok(())
}

/// Whether the vertices are not where the mesh has them. A node's weights count before its mesh's.
fn is_morphed(node: &gltf::Node<'_>, mesh: &gltf::Mesh<'_>) -> bool {
    let weights = node.weights().or(mesh.weights()).unwrap_or_default();
    let mut primitives = mesh.primitives();
    weights.iter().any(|weight| *weight != 0.0)
        && primitives.any(|primitive| primitive.morph_targets().next().is_some())
}
