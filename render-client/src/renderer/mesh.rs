//! Meshes on the graphics card, and their instances.

use std::borrow::Cow;

use bytemuck::{Pod, Zeroable};
use nalgebra::Matrix4;
use taut_proto::{Finish, Look};

use super::gpu::Gpu;
use super::resources::filled;
use super::textured::Textured;
use super::textures::TextureStore;
use crate::detail::{Detail, Level, coarsest};
use crate::normals::Shaded;
use crate::stage::{Bounds, StageBody};

/// A vertex with its normal: 24 bytes, so that 1.7 million triangles take about 41 MB with their indices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Vertex {
    position: [f32; 3],
    /// Folded onto a square, 16 bits each: off by less than 0.006 degrees.
    normal: [i16; 2],
    /// Square roots of linear red, green and blue, 8 bits each; 255 where these count, and not the body's.
    colour: [u8; 4],
    /// Roughness, metallic.
    finish: [u8; 4],
}

/// One body of one state. Mirrors `struct Instance` of mesh.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Instance {
    model: [[f32; 4]; 4],
    colour: [f32; 4],
    finish: [f32; 4],
}

/// How a surface takes light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Material {
    /// Linear red, green, blue; opacity.
    pub(crate) colour: [f32; 4],
    pub(crate) finish: Finish,
    /// Share of the colour shown as it is, without lighting, in [0, 1].
    pub(crate) own_light: f32,
    /// Looks of the mesh's triangles count instead.
    pub(crate) by_triangle: bool,
}

impl Material {
    /// The body's colour and finish; `usual` reflects where it has no finish.
    pub(crate) fn of(body: &StageBody, usual: Finish) -> Self {
        let [red, green, blue] = body.colour;
        Self {
            colour: [red, green, blue, body.opacity],
            finish: body.finish.unwrap_or(usual),
            own_light: 0.0,
            by_triangle: true,
        }
    }
}

/// A mesh on the graphics card.
#[derive(Debug)]
pub(crate) struct MeshBuffers {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    levels: Vec<Level>,
    textured: Option<Textured>,
}

/// Consecutive instances of one mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Batch {
    /// Place of the mesh in the renderer's list.
    pub(crate) mesh: usize,
    /// Places of the instances in the renderer's buffer.
    pub(crate) instances: std::ops::Range<u32>,
    /// Around them all.
    pub(crate) bounds: Bounds,
    /// Metres for the mesh's unit.
    pub(crate) scale: f64,
}

impl Instance {
    /// `workbench_from_mesh` is a rotation times a scale along the mesh's axes, then a translation.
    pub(crate) fn new(workbench_from_mesh: &Matrix4<f64>, material: &Material) -> Self {
        Self {
            model: workbench_from_mesh.cast::<f32>().into(),
            colour: material.colour,
            finish: [
                material.finish.roughness,
                material.own_light,
                material.finish.metallic,
                f32::from(u8::from(material.by_triangle)),
            ],
        }
    }
}

impl MeshBuffers {
    /// `textures` are those of all meshes, where any has some.
    pub(crate) fn new(gpu: &Gpu, shaded: &Shaded, textures: Option<&mut TextureStore>) -> Self {
        let device = &gpu.device;
        let vertex = |&(position, normal, look): &([f32; 3], [f32; 3], u32)| {
            let (colour, finish) = packed(shaded.looks.get(look as usize));
            Vertex {
                position,
                normal: folded(normal),
                colour,
                finish,
            }
        };
        let mut vertices: Vec<Vertex> = shaded.vertices.iter().map(vertex).collect();
        if vertices.is_empty() {
            vertices.push(Vertex::zeroed()); // a buffer has at least one element
        }
        let mut indices = Cow::Borrowed(&shaded.indices);
        let levels = vec![Level::whole(shaded)];
        let mut textured = Textured::of(gpu, shaded, textures);
        if let Some(textured) = &mut textured {
            textured.sort(indices.to_mut(), &levels);
        }
        Self {
            vertices: filled(device, "vertices", &vertices, wgpu::BufferUsages::VERTEX),
            indices: index_buffer(device, &indices),
            levels,
            textured,
        }
    }

    /// Whether it has textures.
    pub(crate) fn is_textured(&self) -> bool {
        self.textured.is_some()
    }

    /// Whether something is seen through its textures.
    pub(crate) fn is_see_through(&self) -> bool {
        let textured = self.textured.as_ref();
        textured.is_some_and(|textured| textured.is_see_through)
    }

    /// Takes the levels of the same mesh.
    pub(crate) fn refine(&mut self, device: &wgpu::Device, mut detail: Detail) {
        if let Some(textured) = &mut self.textured {
            textured.sort(&mut detail.indices, &detail.levels);
        }
        self.indices = index_buffer(device, &detail.indices);
        self.levels = detail.levels;
    }

    /// Size on the graphics card, in bytes.
    pub(crate) fn bytes(&self) -> u64 {
        let textured = self.textured.as_ref();
        let coordinates = textured.map_or(0, |textured| textured.coordinates.size());
        self.vertices.size() + self.indices.size() + coordinates
    }

    /// Draws instances with the fewest triangles that are off by at most `error`, in the mesh's unit; pipeline, bind group and instance buffer
    /// (slot 1) are set. How many triangles that were. `with_textures`: the pipeline is one of textured bodies, and so is the mesh.
    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        instances: std::ops::Range<u32>,
        error: f64,
        with_textures: bool,
    ) -> u64 {
        let level = coarsest(&self.levels, error);
        let indices = &self.levels[level].indices;
        let triangles = indices.len() * instances.len() / 3;
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        match self.textured.as_ref().filter(|_| with_textures) {
            Some(textured) => textured.draw(pass, level, &instances),
            None => pass.draw_indexed(indices.clone(), 0, instances),
        }
        triangles as u64
    }
}

/// Colour and finish of a vertex; those of the body where it has no look.
fn packed(look: Option<&Look>) -> ([u8; 4], [u8; 4]) {
    let Some(look) = look else {
        return ([0; 4], [0; 4]);
    };
    let byte = |share: f32| (255.0 * share).round() as u8;
    let [red, green, blue] = look.colour.map(|light| byte(light.sqrt()));
    let [roughness, metallic] = [look.finish.roughness, look.finish.metallic].map(byte);
    ([red, green, blue, 255], [roughness, metallic, 0, 0])
}

fn index_buffer(device: &wgpu::Device, indices: &[u32]) -> wgpu::Buffer {
    let at_least_one = if indices.is_empty() { &[0] } else { indices };
    filled(device, "indices", at_least_one, wgpu::BufferUsages::INDEX)
}

/// The place of a unit vector on the octahedron |x| + |y| + |z| = 1, folded out to a square, ±32767 at its edges.
fn folded([x, y, z]: [f32; 3]) -> [i16; 2] {
    let size = (x.abs() + y.abs() + z.abs()).max(f32::MIN_POSITIVE);
    let (x, y, z) = (x / size, y / size, z / size);
    let place = if z >= 0.0 {
        [x, y]
    } else {
        [(1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)]
    };
    place.map(|p| (p * f32::from(i16::MAX)).round() as i16)
}

const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 4] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Snorm16x2, 8 => Unorm8x4, 9 => Unorm8x4];
const INSTANCE_ATTRIBUTES: [wgpu::VertexAttribute; 6] = wgpu::vertex_attr_array![
    2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4, 6 => Float32x4, 7 => Float32x4
];

const COORDINATE_ATTRIBUTES: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![10 => Float32x2];

/// Layout of the third vertex buffer of a textured mesh: places in its textures.
pub(crate) fn coordinate_layout() -> Option<wgpu::VertexBufferLayout<'static>> {
    Some(wgpu::VertexBufferLayout {
        array_stride: size_of::<[f32; 2]>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &COORDINATE_ATTRIBUTES,
    })
}

/// Layouts of the two vertex buffers: vertices, instances.
pub(crate) fn buffer_layouts() -> [Option<wgpu::VertexBufferLayout<'static>>; 2] {
    let layout = |stride: usize, step_mode, attributes| {
        Some(wgpu::VertexBufferLayout {
            array_stride: stride as u64,
            step_mode,
            attributes,
        })
    };
    [
        layout(
            size_of::<Vertex>(),
            wgpu::VertexStepMode::Vertex,
            &VERTEX_ATTRIBUTES,
        ),
        layout(
            size_of::<Instance>(),
            wgpu::VertexStepMode::Instance,
            &INSTANCE_ATTRIBUTES,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    /// What mesh.wgsl does.
    fn unfolded(place: [i16; 2]) -> Vector3<f32> {
        let [x, y] = place.map(|p| f32::from(p) / f32::from(i16::MAX));
        let height = 1.0 - x.abs() - y.abs();
        let back = (-height).max(0.0);
        let toward = |p: f32| if p >= 0.0 { p - back } else { p + back };
        Vector3::new(toward(x), toward(y), height).normalize()
    }

    proptest! {
        #[test]
        fn a_normal_survives_its_folding(
            x in -1.0..1.0f32, y in -1.0..1.0f32, z in -1.0..1.0f32,
        ) {
            let vector = Vector3::new(x, y, z);
            prop_assume!(vector.norm() > 1e-3);
            let normal = vector.normalize();
            let error = unfolded(folded(normal.into())).cross(&normal).norm();
            prop_assert!(error.asin().to_degrees() < 0.006);
        }
    }

    #[test]
    fn the_axes_survive_exactly() {
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            for normal in [axis, -axis] {
                assert!((unfolded(folded(normal.into())) - normal).norm() < 1e-6);
            }
        }
    }
}
