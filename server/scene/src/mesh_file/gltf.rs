//! glTF 2.0 (.gltf with its buffers, .glb): all triangle primitives of the default scene, node transforms applied.

use std::path::Path;

use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::Source;
use gltf::json::validation::Checked;
use gltf::material::AlphaMode;
use gltf::mesh::Mode;
use god_object::surface::CornerCoordinates;
use nalgebra::{Matrix4, Point3};
use percent_encoding::percent_decode_str;

use super::material::{Material, Materials};
use super::pieces::Pieces;
use super::read::{below, finite_vertex};
use super::{Fault, RawMesh};
use crate::appearance::Appearance;
use crate::files::{MAX_MESH_BYTES, read_bytes};

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
    materials.list = file.materials().map(|of| material(&of)).collect();
    let buffers = buffers(&file, directory)?;
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
                let before = mesh.triangles.len();
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
                pieces.grow(count);
                materials.vertex_colours |= primitive.get(&gltf::Semantic::Colors(0)).is_some();
            }
        }
        pending.extend(placed.children());
    }
    Ok(mesh)
}

/// A node of the tree, and where it is.
struct Placed<'f> {
    node: gltf::Node<'f>,
    world_from_node: Matrix4<f64>,
    depth: usize,
    /// Names of the nodes that it hangs below.
    names_above: Vec<String>,
}

impl<'f> Placed<'f> {
    fn root(node: gltf::Node<'f>) -> Self {
        Self {
            world_from_node: transform(&node),
            node,
            depth: 0,
            names_above: Vec::new(),
        }
    }

    fn children(&self) -> impl Iterator<Item = Self> {
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
    fn names(&self) -> Vec<String> {
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
fn posed_as_it_is(node: &gltf::Node<'_>, mesh: &gltf::Mesh<'_>) -> Result<(), Fault> {
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

/// What a material says without pictures: a factor of a picture says nothing alone.
fn material(of: &gltf::Material<'_>) -> Material {
    let share = |value: f32| value.is_finite().then(|| value.clamp(0.0, 1.0));
    let surface = of.pbr_metallic_roughness();
    let [red, green, blue, alpha] = surface.base_color_factor();
    let (picture, finish) = (
        surface.base_color_texture().is_some(),
        surface.metallic_roughness_texture().is_some(),
    );
    let colour = || Some([share(red)?, share(green)?, share(blue)?]);
    Material {
        name: of.name().unwrap_or("unnamed").to_owned(),
        appearance: Appearance {
            color: if picture { None } else { colour() },
            roughness: share(surface.roughness_factor()).filter(|_| !finish),
            metallic: share(surface.metallic_factor()).filter(|_| !finish),
            opacity: share(alpha).filter(|_| of.alpha_mode() == AlphaMode::Blend && !picture),
        },
        textured: picture
            || finish
            || of.normal_texture().is_some()
            || of.occlusion_texture().is_some()
            || of.emissive_texture().is_some(),
        is_defined: true,
    }
}

/// The file as the crate validates it, around what the crate panics at: its reader of containers subtracts lengths unseen, and its
/// validation reads the accessor of a primitive's positions before it knows that there is one.
fn validated(bytes: &[u8]) -> Result<gltf::Gltf, Fault> {
    let invalid = |e: gltf::Error| Fault::new(format!("is no valid glTF ({e}); export it again"));
    let (json, blob) = if bytes.starts_with(GLB_MAGIC) {
        chunks(bytes).ok_or_else(|| {
            Fault::new("is no valid GLB: its chunks are cut off; copy the file again")
        })?
    } else {
        (bytes, None)
    };
    let root = gltf::json::deserialize::from_slice::<gltf::json::Root>(json)
        .map_err(|e| invalid(gltf::Error::Deserialize(e)))?;
    if let Some(compression) = root
        .extensions_used
        .iter()
        .chain(&root.extensions_required)
        .find_map(|name| compression(name))
    {
        return Err(Fault::new(format!(
            "has meshes that are compressed with {compression}, which is not read; export it without {compression} compression"
        )));
    }
    let positions = Checked::Valid(gltf::Semantic::Positions);
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut named = primitives.filter_map(|primitive| primitive.attributes.get(&positions));
    if let Some(missing) = named.find(|index| index.value() >= root.accessors.len()) {
        let text = format!(
            "has positions in accessor {}, but {} accessors; export it again",
            missing.value(),
            root.accessors.len()
        );
        return Err(Fault::new(text));
    }
    Ok(gltf::Gltf {
        document: gltf::Document::from_json(root).map_err(invalid)?,
        blob: blob.map(<[u8]>::to_vec),
    })
}

/// The compression that an extension is, if it is one.
fn compression(extension: &str) -> Option<&'static str> {
    match extension {
        "KHR_draco_mesh_compression" => Some("Draco"),
        "EXT_meshopt_compression" | "KHR_meshopt_compression" => Some("meshopt"),
        _ => None,
    }
}

/// First bytes of a GLB container.
const GLB_MAGIC: &[u8] = b"glTF";

/// The text and the buffer, if there is one, of a GLB container of version 2; further chunks are passed over. `None` if it is none.
///
/// Source: glTF 2.0, section 4 (GLB file format).
fn chunks(bytes: &[u8]) -> Option<(&[u8], Option<&[u8]>)> {
    let (magic, rest) = bytes.split_at_checked(GLB_MAGIC.len())?;
    let (version, rest) = rest.split_first_chunk::<4>()?;
    let (length, _) = rest.split_first_chunk::<4>()?;
    let whole = bytes.get(12..u32::from_le_bytes(*length) as usize)?;
    let (json, rest) = chunk(whole, b"JSON")?;
    let is_glb = magic == GLB_MAGIC && u32::from_le_bytes(*version) == 2;
    is_glb.then_some((json, chunk(rest, b"BIN\0").map(|(buffer, _)| buffer)))
}

/// The content of the first chunk if it is of this kind, and what follows it.
fn chunk<'a>(bytes: &'a [u8], wanted: &[u8; 4]) -> Option<(&'a [u8], &'a [u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (kind, rest) = rest.split_first_chunk::<4>()?;
    let found = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    (kind == wanted).then_some(found)
}

fn buffers(file: &gltf::Gltf, directory: Option<&Path>) -> Result<Vec<Vec<u8>>, Fault> {
    let mut all = Vec::new();
    for buffer in file.buffers() {
        let number = buffer.index();
        let bytes = match buffer.source() {
            Source::Bin => file
                .blob
                .clone()
                .ok_or_else(|| Fault::new("has no binary part; export it again as .glb"))?,
            Source::Uri(uri) => match embedded(uri) {
                Some(data) => decode_base64(data).ok_or_else(|| {
                    Fault::new(format!(
                        "buffer {number} is no valid base64; export it again"
                    ))
                })?,
                None => {
                    let decoded = percent_decode_str(uri).decode_utf8().map_err(|_| {
                        Fault::new(format!("buffer {number} is `{uri}`, which is no text when its %.. are decoded; export it as .glb"))
                    })?;
                    let beside = directory.zip(below(&decoded));
                    let (directory, named) = beside.ok_or_else(|| {
                        Fault::new(format!("buffer {number} is `{uri}`, but must lie beside the file; export it as .glb"))
                    })?;
                    read_bytes(&directory.join(named), MAX_MESH_BYTES).map_err(|problem| {
                        Fault::new(format!("needs buffer {number}: {problem}"))
                    })?
                }
            },
        };
        if bytes.len() < buffer.length() {
            let text = format!(
                "buffer {number} is cut off: {} of {} bytes are there",
                bytes.len(),
                buffer.length()
            );
            return Err(Fault::new(text + "; copy the file again"));
        }
        all.push(bytes);
    }
    Ok(all)
}

/// The base64 of a buffer that is within the file.
fn embedded(uri: &str) -> Option<&str> {
    let (_, data) = uri.strip_prefix("data:")?.split_once(";base64,")?;
    Some(data)
}

/// Names of the files that hold the buffers; none of a file that is no glTF.
pub(super) fn buffer_files(bytes: &[u8]) -> Vec<String> {
    let named = |buffer: gltf::Buffer<'_>| match buffer.source() {
        Source::Uri(uri) if embedded(uri).is_none() => {
            let decoded = percent_decode_str(uri).decode_utf8().ok()?;
            Some(decoded.into_owned())
        }
        _ => None,
    };
    validated(bytes).map_or_else(
        |_| Vec::new(),
        |file| file.buffers().filter_map(named).collect(),
    )
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
        let of_vertices = texture_coordinates(primitive, buffers, count)?;
        let of_corners = triangles
            .iter()
            .map(|t| t.map(|corner| of_vertices[corner as usize].map(f64::from)));
        coordinates.extend(of_corners);
    }
    Ok(())
}

/// The first set of texture coordinates, one pair for each of the `count` vertices.
fn texture_coordinates(
    primitive: &gltf::Primitive<'_>,
    buffers: &[Vec<u8>],
    count: usize,
) -> Result<Vec<[f32; 2]>, String> {
    let accessor = primitive
        .get(&gltf::Semantic::TexCoords(0))
        .ok_or("has no texture coordinates; export it with them")?;
    check_accessor(&accessor, buffers)?;
    let known = matches!(
        accessor.data_type(),
        DataType::F32 | DataType::U8 | DataType::U16
    );
    if accessor.dimensions() != Dimensions::Vec2 || !known {
        return Err(
            "has texture coordinates that are not pairs of numbers; export it again".into(),
        );
    }
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
    let pairs: Vec<[f32; 2]> = reader
        .read_tex_coords(0)
        .ok_or("has unreadable texture coordinates; export it again")?
        .into_f32()
        .collect();
    if pairs.len() == count {
        Ok(pairs)
    } else {
        Err(format!(
            "has {} texture coordinates for {count} vertices; export it again",
            pairs.len()
        ))
    }
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
fn check_accessor(accessor: &gltf::Accessor<'_>, buffers: &[Vec<u8>]) -> Result<(), String> {
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

/// RFC 4648, with or without padding; `None` for any other character.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0u32);
    for character in text.trim_end_matches('=').bytes() {
        let value = match character {
            b'A'..=b'Z' => character - b'A',
            b'a'..=b'z' => character - b'a' + 26,
            b'0'..=b'9' => character - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        held = (held << 6 | u32::from(value)) & 0xFFFF;
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            bytes.push((held >> bits) as u8);
        }
    }
    Some(bytes)
}

#[cfg(test)]
#[path = "gltf_tests.rs"]
mod tests;
