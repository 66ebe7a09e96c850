//! glTF 2.0 (.gltf with its buffers, .glb): all triangle primitives of the default scene, node transforms applied.

use std::path::Path;

use gltf::accessor::{DataType, Dimensions};
use gltf::material::AlphaMode;
use gltf::mesh::Mode;
use god_object::surface::CornerCoordinates;
use nalgebra::{Matrix4, Point3};

use super::gltf_container::{buffers, validated};
use super::gltf_nodes::{Placed, posed_as_it_is};
use super::gltf_pictures::{laid, picture, texture_coordinates};
use super::material::{Material, Materials};
use super::pieces::Pieces;
use super::read::finite_vertex;
use super::{Fault, RawMesh};
use crate::appearance::Appearance;

/// Deepest tree of nodes. Deeper is a loop or a joke.
const MAX_NODE_DEPTH: usize = 64;
/// Most nodes visited. A node may hang below several parents.
const MAX_NODES: usize = 100_000;

/// The mesh; which material each triangle has goes to `materials`, of which nodes it is to `pieces`.
pub(super) fn parse(
    bytes: &[u8],
    directory: Option<&Path>,
    materials: &mut Materials,
    pieces: &mut Pieces,
) -> Result<RawMesh, Fault> {
    parse_with(bytes, directory, (materials, pieces), None).map(RawMesh::welded)
}

/// Texture coordinates of every triangle that [`parse`] gives, in its order. v runs down the picture, as it does in the file.
pub(super) fn parse_texture_coordinates(
    bytes: &[u8],
    directory: Option<&Path>,
) -> Result<Vec<CornerCoordinates>, Fault> {
    let mut coordinates = Vec::new();
    let told = (&mut Materials::default(), &mut Pieces::default());
    parse_with(bytes, directory, told, Some(&mut coordinates))?;
    Ok(coordinates)
}

/// Vertices as often as the file has them.
fn parse_with(
    bytes: &[u8],
    directory: Option<&Path>,
    (materials, pieces): (&mut Materials, &mut Pieces),
    mut coordinates: Option<&mut Vec<CornerCoordinates>>,
) -> Result<RawMesh, Fault> {
    let file = validated(bytes)?;
    let buffers = buffers(&file, directory)?;
    let read = file.materials().map(|of| material(&of, &buffers));
    materials.list = read.collect();
    let have_pictures = materials.have_pictures();
    let Some(scene) = file.default_scene().or_else(|| file.scenes().next()) else {
        return Err(Fault::new("has no scene; export it with one"));
    };
    let others = file.scenes().filter(|other| other.index() != scene.index());
    pieces.left_out.extend(others.map(|other| {
        format!(
            "scene {} \"{}\" of the file is left out: only its default scene is read",
            other.index(),
            other.name().unwrap_or("unnamed")
        )
    }));
    let mut mesh = RawMesh::default();
    let mut pending: Vec<_> = scene.nodes().map(Placed::root).collect();
    pending.reverse();
    let mut visited = 0;
    while let Some(placed) = pending.pop() {
        let node = &placed.node;
        visited += 1;
        if placed.depth > MAX_NODE_DEPTH || visited > MAX_NODES {
            return Err(Fault::new(format!(
                "node {} lies too deep or in a loop; flatten the scene",
                node.index()
            )));
        }
        if let Some(of_node) = node.mesh() {
            posed_as_it_is(node, &of_node)?;
            pieces.begin(placed.names());
            for primitive in of_node.primitives() {
                let (before, first) = (mesh.triangles.len(), mesh.vertices.len());
                append(
                    &mut mesh,
                    coordinates.as_deref_mut(),
                    &primitive,
                    &placed.world_from_node,
                    &buffers,
                )
                .map_err(|text| {
                    Fault::new(format!(
                        "mesh {} primitive {}: {text}",
                        of_node.index(),
                        primitive.index()
                    ))
                })?;
                let count = mesh.triangles.len() - before;
                materials.push(primitive.material().index(), count);
                if have_pictures {
                    let used = primitive.material().index();
                    let used = used.and_then(|place| materials.list[place].picture.as_ref());
                    let laid = laid(&primitive, used, &buffers, (&mesh, before, first));
                    materials.coordinates.extend(laid);
                }
                pieces.grow(count);
                materials.vertex_colours |= primitive.get(&gltf::Semantic::Colors(0)).is_some();
            }
        }
        pending.extend(placed.children());
    }
    Ok(mesh)
}

/// What a material says.
fn material(of: &gltf::Material<'_>, buffers: &[Vec<u8>]) -> Material {
    let share = |value: f32| value.is_finite().then(|| value.clamp(0.0, 1.0));
    let surface = of.pbr_metallic_roughness();
    let [red, green, blue, alpha] = surface.base_color_factor();
    // A factor of a picture that is not read says nothing alone.
    let finish = surface.metallic_roughness_texture().is_some();
    let colour = || Some([share(red)?, share(green)?, share(blue)?]);
    Material {
        name: of.name().unwrap_or("unnamed").to_owned(),
        appearance: Appearance {
            color: colour(),
            roughness: share(surface.roughness_factor()).filter(|_| !finish),
            metallic: share(surface.metallic_factor()).filter(|_| !finish),
            opacity: share(alpha).filter(|_| of.alpha_mode() == AlphaMode::Blend),
        },
        picture: picture(of, buffers),
        textured: finish
            || of.normal_texture().is_some()
            || of.occlusion_texture().is_some()
            || of.emissive_texture().is_some(),
        is_defined: true,
    }
}

/// Positions are three floats for a vertex, indices unsigned integers, and both lie within their buffers.
fn check_layout(primitive: &gltf::Primitive<'_>, buffers: &[Vec<u8>]) -> Result<(), String> {
    let positions = primitive
        .get(&gltf::Semantic::Positions)
        .ok_or("has no positions; remove it")?;
    check_accessor(&positions, buffers)?;
    if positions.dimensions() != Dimensions::Vec3 || positions.data_type() != DataType::F32 {
        return Err(
            "has positions that are not three 32-bit floats; export it without compression".into(),
        );
    }
    if let Some(indices) = primitive.indices() {
        check_accessor(&indices, buffers)?;
        let unsigned = matches!(
            indices.data_type(),
            DataType::U8 | DataType::U16 | DataType::U32
        );
        if indices.dimensions() != Dimensions::Scalar || !unsigned {
            return Err("has indices that are no unsigned integers; export it again".into());
        }
    }
    Ok(())
}

/// Adds a primitive's vertices and triangles to `mesh`, and their texture coordinates to `coordinates` where those are wanted.
fn append(
    mesh: &mut RawMesh,
    coordinates: Option<&mut Vec<CornerCoordinates>>,
    primitive: &gltf::Primitive<'_>,
    world_from_node: &Matrix4<f64>,
    buffers: &[Vec<u8>],
) -> Result<(), String> {
    if !matches!(
        primitive.mode(),
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
    ) {
        return Err("is no triangles (points or lines); remove it".into());
    }
    check_layout(primitive, buffers)?;
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
    let first = mesh.vertices.len();
    for (number, position) in reader
        .read_positions()
        .ok_or("has unreadable positions; export it again")?
        .enumerate()
    {
        let local = Point3::from(position.map(f64::from));
        let placed = world_from_node.transform_point(&local);
        mesh.vertices
            .push(finite_vertex(number, [placed.x, placed.y, placed.z])?);
    }
    let count = mesh.vertices.len() - first;
    if u32::try_from(mesh.vertices.len()).is_err() {
        return Err("has too many vertices; simplify the mesh".into());
    }
    let corners: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..count as u32).collect(),
    };
    if let Some(wrong) = corners.iter().find(|corner| **corner as usize >= count) {
        return Err(format!(
            "an index is {wrong}, but there are {count} vertices; export it again"
        ));
    }
    let mirrored = world_from_node.determinant() < 0.0;
    let mut triangles = triangles(primitive.mode(), &corners);
    if mirrored {
        triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    }
    let placed = triangles
        .iter()
        .map(|t| t.map(|corner| first as u32 + corner));
    mesh.triangles.extend(placed);
    if let Some(coordinates) = coordinates {
        let of_vertices = texture_coordinates(primitive, 0, buffers, count)?;
        let of_corners = triangles
            .iter()
            .map(|t| t.map(|corner| of_vertices[corner as usize].map(f64::from)));
        coordinates.extend(of_corners);
    }
    Ok(())
}

/// Corners to triangles; every second one of a strip is turned.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[1], w[0], w[2]]
                }
            })
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect(),
        Mode::TriangleFan => corners
            .windows(2)
            .skip(1)
            .map(|w| [corners[0], w[0], w[1]])
            .collect(),
        _ => corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
    }
}

/// The accessor lies within its buffer, so that reading it cannot fail.
pub(super) fn check_accessor(
    accessor: &gltf::Accessor<'_>,
    buffers: &[Vec<u8>],
) -> Result<(), String> {
    let number = accessor.index();
    if accessor.sparse().is_some() {
        return Err(format!(
            "accessor {number} is sparse; export the mesh without sparse accessors"
        ));
    }
    let view = accessor.view().ok_or_else(|| {
        format!("accessor {number} has no data; export the mesh without compression")
    })?;
    let length = buffers.get(view.buffer().index()).map_or(0, Vec::len);
    let stride = view.stride().unwrap_or(accessor.size());
    if stride < accessor.size() {
        return Err(format!(
            "accessor {number} has elements that overlap (byteStride {stride}); export the file again"
        ));
    }
    let last = accessor
        .count()
        .checked_sub(1)
        .ok_or_else(|| format!("accessor {number} is empty; remove the primitive"))?;
    let end_in_view = stride
        .checked_mul(last)
        .and_then(|n| n.checked_add(accessor.size()))
        .and_then(|n| n.checked_add(accessor.offset()));
    let view_end = view.offset().checked_add(view.length());
    let fits = end_in_view.is_some_and(|end| end <= view.length())
        && view_end.is_some_and(|end| end <= length);
    let past = || format!("accessor {number} reaches past its buffer; export the file again");
    fits.then_some(()).ok_or_else(past)
}

#[cfg(test)]
#[path = "gltf_tests.rs"]
mod tests;
