//! Pictures of the materials of a glTF file, and where its triangles lie in them.

use std::path::PathBuf;
use std::sync::Arc;

use gltf::accessor::{DataType, Dimensions};
use gltf::image::Source;
use gltf::material::AlphaMode;
use gltf::texture::WrappingMode;
use percent_encoding::percent_decode_str;
use taut_proto::Wrap;

use super::RawMesh;
use super::body_textures::Corners;
use super::gltf::check_accessor;
use super::gltf_container::{decode_base64, embedded};
use super::picture_use::{AS_IT_LIES, PictureSource, PictureUse};

/// The picture of a material's colour, if it has one.
pub(super) fn picture(of: &gltf::Material<'_>, buffers: &[Vec<u8>]) -> Option<PictureUse> {
    let info = of.pbr_metallic_roughness().base_color_texture()?;
    let texture = info.texture();
    let transform = info.texture_transform();
    let set = transform.as_ref().and_then(|t| t.tex_coord());
    let sampler = texture.sampler();
    Some(PictureUse {
        source: source(&texture, buffers),
        set: set.unwrap_or(info.tex_coord()),
        wrap: [sampler.wrap_s(), sampler.wrap_t()].map(wrap),
        placing: transform.map_or(AS_IT_LIES, |t| placing(&t)),
        is_opacity: of.alpha_mode() != AlphaMode::Opaque,
    })
}

fn wrap(mode: WrappingMode) -> Wrap {
    match mode {
        WrappingMode::Repeat => Wrap::Repeat,
        WrappingMode::MirroredRepeat => Wrap::Mirror,
        WrappingMode::ClampToEdge => Wrap::Clamp,
    }
}

/// Scaled, then turned anticlockwise as seen with v down, then moved.
///
/// Source: `KHR_texture_transform`, in the direction that its test model shows.
fn placing(transform: &gltf::texture::TextureTransform<'_>) -> [[f64; 3]; 2] {
    let ([su, sv], [ou, ov]) = (transform.scale(), transform.offset());
    let [su, sv, ou, ov] = [su, sv, ou, ov].map(f64::from);
    let (sine, cosine) = f64::from(transform.rotation()).sin_cos();
    [[cosine * su, sine * sv, ou], [-sine * su, cosine * sv, ov]]
}

fn source(texture: &gltf::Texture<'_>, buffers: &[Vec<u8>]) -> PictureSource {
    let nowhere = |name: String, why: &str| PictureSource::Nowhere {
        name,
        why: why.to_owned(),
    };
    let Some(image) = texture.source() else {
        let why = "is stored in a format that is not read (KTX2, WebP); export it as PNG or JPEG";
        return nowhere(format!("texture {}", texture.index()), why);
    };
    let name = || {
        let named = image.name().filter(|name| !name.is_empty());
        named.map_or_else(|| format!("image {}", image.index()), str::to_owned)
    };
    let within = |bytes: Option<Vec<u8>>, why: &str| match bytes {
        Some(bytes) => PictureSource::Within {
            name: name(),
            bytes: Arc::from(bytes),
        },
        None => nowhere(name(), why),
    };
    match image.source() {
        Source::View { view, .. } => {
            let end = view.offset().checked_add(view.length());
            let buffer = buffers.get(view.buffer().index());
            let bytes = buffer
                .zip(end)
                .and_then(|(all, end)| all.get(view.offset()..end));
            within(
                bytes.map(<[u8]>::to_vec),
                "reaches past its buffer; export the file again",
            )
        }
        Source::Uri { uri, .. } => match embedded(uri) {
            Some(data) => within(decode_base64(data), "is no valid base64; export it again"),
            None => match percent_decode_str(uri).decode_utf8() {
                Ok(name) => PictureSource::Beside {
                    folder: PathBuf::new(),
                    name: name.into_owned(),
                },
                Err(_) => nowhere(
                    name(),
                    "has a name that is no text when its %.. are decoded",
                ),
            },
        },
    }
}

/// Where the triangles of a primitive lie in the picture of its material: those of the mesh from the first on, whose vertices begin at `first` there. Not
/// finite where the file does not say so.
pub(super) fn laid(
    primitive: &gltf::Primitive<'_>,
    used: Option<&PictureUse>,
    buffers: &[Vec<u8>],
    (mesh, from, first): (&RawMesh, usize, usize),
) -> Vec<Corners> {
    let (triangles, count) = (&mesh.triangles[from..], mesh.vertices.len() - first);
    let pairs = used.and_then(|used| texture_coordinates(primitive, used.set, buffers, count).ok());
    let Some(pairs) = pairs else {
        return vec![[[f32::NAN; 2]; 3]; triangles.len()];
    };
    let corners = triangles.iter();
    corners
        .map(|t| t.map(|vertex| pairs[vertex as usize - first]))
        .collect()
}

/// The set of texture coordinates of this number, one pair for each of the `count` vertices.
pub(super) fn texture_coordinates(
    primitive: &gltf::Primitive<'_>,
    set: u32,
    buffers: &[Vec<u8>],
    count: usize,
) -> Result<Vec<[f32; 2]>, String> {
    let accessor = primitive
        .get(&gltf::Semantic::TexCoords(set))
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
        .read_tex_coords(set)
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
