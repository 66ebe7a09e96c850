//! A glTF file before its scene is read: text and container, checked, and its buffers.

use std::path::Path;

use gltf::buffer::Source;
use gltf::json::validation::Checked;
use percent_encoding::percent_decode_str;

use super::Fault;
use super::read::below;
use crate::files::{MAX_MESH_BYTES, read_bytes};

/// The file as the crate validates it, around what the crate panics at: its reader of containers subtracts lengths unseen, and its
/// validation reads the accessor of a primitive's positions before it knows that there is one.
pub(super) fn validated(bytes: &[u8]) -> Result<gltf::Gltf, Fault> {
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

pub(super) fn buffers(file: &gltf::Gltf, directory: Option<&Path>) -> Result<Vec<Vec<u8>>, Fault> {
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

/// The base64 of a buffer or picture that is within the file.
pub(super) fn embedded(uri: &str) -> Option<&str> {
    let (_, data) = uri.strip_prefix("data:")?.split_once(";base64,")?;
    Some(data)
}

/// Names of the files that hold the buffers and the pictures of colours; none of a file that is no glTF.
pub(super) fn files(bytes: &[u8]) -> Vec<String> {
    let Ok(file) = validated(bytes) else {
        return Vec::new();
    };
    let buffers = file.buffers().filter_map(|buffer| match buffer.source() {
        Source::Uri(uri) => Some(uri),
        Source::Bin => None,
    });
    let pictures = file.materials().filter_map(|of| {
        let texture = of.pbr_metallic_roughness().base_color_texture()?;
        match texture.texture().source()?.source() {
            gltf::image::Source::Uri { uri, .. } => Some(uri),
            gltf::image::Source::View { .. } => None,
        }
    });
    let mut names: Vec<String> = Vec::new();
    for uri in buffers
        .chain(pictures)
        .filter(|uri| embedded(uri).is_none())
    {
        let decoded = percent_decode_str(uri).decode_utf8();
        let name = decoded.ok().filter(|name| !names.iter().any(|n| n == name));
        names.extend(name.map(std::borrow::Cow::into_owned));
    }
    names
}

/// RFC 4648, with or without padding; `None` for any other character.
pub(super) fn decode_base64(text: &str) -> Option<Vec<u8>> {
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
