//! The part of a mesh on the graphics card that only one with textures has.

use std::ops::Range;

use super::gpu::Gpu;
use super::resources::filled;
use super::textures::TextureStore;
use crate::detail::Level;
use crate::normals::Shaded;

/// Places in textures, and which triangles have which.
#[derive(Debug)]
pub(crate) struct Textured {
    pub(crate) coordinates: wgpu::Buffer,
    groups: Vec<wgpu::BindGroup>,
    /// Place in `groups`, for each vertex.
    of_vertices: Vec<u8>,
    /// For each level of detail: places in `groups`, and the indices that have them.
    parts: Vec<Vec<(usize, Range<u32>)>>,
    pub(crate) is_see_through: bool,
}

impl Textured {
    /// `None` of a mesh without textures.
    pub(crate) fn of(gpu: &Gpu, shaded: &Shaded, store: Option<&mut TextureStore>) -> Option<Self> {
        let textures = shaded.textures.as_ref()?;
        let groups = store?.groups(gpu, textures);
        let none = groups.len() - 1;
        let of = |&(_, _, look): &([f32; 3], [f32; 3], u32)| {
            textures.of_look(look).unwrap_or(none as u8) // at most 64
        };
        let at_least_one = [[0.0; 2]];
        let coordinates = match shaded.coordinates.as_slice() {
            [] => &at_least_one[..],
            all => all,
        };
        Some(Self {
            coordinates: filled(
                &gpu.device,
                "places in textures",
                coordinates,
                wgpu::BufferUsages::VERTEX,
            ),
            of_vertices: shaded.vertices.iter().map(of).collect(),
            groups,
            parts: Vec::new(),
            is_see_through: textures.are_see_through(),
        })
    }

    /// Brings the triangles of each level into the order of their textures.
    pub(crate) fn sort(&mut self, indices: &mut [u32], levels: &[Level]) {
        let of_level = |level: &Level| {
            let (first, end) = (level.indices.start, level.indices.end);
            let part = &mut indices[first as usize..end as usize];
            by_texture(part, &self.of_vertices, self.groups.len(), first)
        };
        self.parts = levels.iter().map(of_level).collect();
    }

    /// Draws instances of a level; pipeline, the other buffers and the view's bindings are set.
    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        level: usize,
        instances: &Range<u32>,
    ) {
        pass.set_vertex_buffer(2, self.coordinates.slice(..));
        for (group, indices) in &self.parts[level] {
            pass.set_bind_group(1, &self.groups[*group], &[]);
            pass.draw_indexed(indices.clone(), 0, instances.clone());
        }
    }
}

/// Sorts triangles by their texture, else in the order that they have: which there are, and where, counted from `first`.
fn by_texture(
    indices: &mut [u32],
    of_vertices: &[u8],
    textures: usize,
    first: u32,
) -> Vec<(usize, Range<u32>)> {
    let mut sorted: Vec<Vec<u32>> = vec![Vec::new(); textures];
    for triangle in indices.chunks_exact(3) {
        // Its corners have one look.
        sorted[usize::from(of_vertices[triangle[0] as usize])].extend(triangle);
    }
    let mut parts = Vec::new();
    let mut end = 0;
    for (texture, of_it) in sorted
        .iter()
        .enumerate()
        .filter(|(_, of_it)| !of_it.is_empty())
    {
        let start = end;
        end += of_it.len();
        indices[start..end].copy_from_slice(of_it);
        parts.push((texture, first + start as u32..first + end as u32));
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_sorted_by_texture_and_stay_in_their_order_within() {
        let mut indices = [0, 1, 2, 3, 4, 5, 2, 1, 0, 6, 7, 8];
        let of_vertices = [2, 2, 2, 0, 0, 0, 2, 2, 2];
        let parts = by_texture(&mut indices, &of_vertices, 3, 30);
        assert_eq!(parts, [(0, 30..33), (2, 33..42)]);
        assert_eq!(indices, [3, 4, 5, 0, 1, 2, 2, 1, 0, 6, 7, 8]);
        assert_eq!(by_texture(&mut [], &[], 3, 0), []);
    }
}
