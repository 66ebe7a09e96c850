//! Solids as triangles with corners of their own, m.

use taut_scene::RawMesh;
use taut_scene::shapes;

pub(crate) type Point = [f64; 3];
pub(crate) type Triangle = [Point; 3];
pub(crate) type Soup = Vec<Triangle>;

/// Half sides of the box that most cases are made of, m.
pub(crate) const HALF: Point = [0.03, 0.02, 0.01];
/// Its volume, m^3.
pub(crate) const VOLUME: f64 = 4.8e-5;

pub(crate) fn soup_of(mesh: &RawMesh) -> Soup {
    let corner = |v: u32| mesh.vertices[v as usize].into();
    mesh.triangles.iter().map(|t| t.map(corner)).collect()
}

pub(crate) fn cuboid(half: Point) -> Soup {
    soup_of(&shapes::cuboid(half))
}

pub(crate) fn part() -> Soup {
    cuboid(HALF)
}

/// 320 triangles.
pub(crate) fn ball(radius: f64) -> Soup {
    soup_of(&shapes::sphere(radius, 2))
}

pub(crate) fn moved(soup: Soup, way: Point) -> Soup {
    mapped(soup, |p| [0, 1, 2].map(|k| p[k] + way[k]))
}

pub(crate) fn scaled(soup: Soup, factor: f64) -> Soup {
    mapped(soup, |p| p.map(|c| c * factor))
}

pub(crate) fn mapped(soup: Soup, mut map: impl FnMut(Point) -> Point) -> Soup {
    soup.into_iter().map(|t| t.map(&mut map)).collect()
}

pub(crate) fn flipped(soup: Soup) -> Soup {
    soup.into_iter().map(|[a, b, c]| [a, c, b]).collect()
}

pub(crate) fn joined<const N: usize>(soups: [Soup; N]) -> Soup {
    soups.into_iter().flatten().collect()
}

/// Six times the signed volume of a triangle and the origin.
pub(crate) fn six_volumes([a, b, c]: &Triangle) -> f64 {
    dot(*a, cross(*b, *c))
}

pub(crate) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// With these triangles at the end.
pub(crate) fn with(mut soup: Soup, more: &[Triangle]) -> Soup {
    soup.extend_from_slice(more);
    soup
}

/// Without the triangles whose corners all satisfy `gone`.
pub(crate) fn without(soup: Soup, gone: impl Fn(&Point) -> bool) -> Soup {
    soup.into_iter().filter(|t| !t.iter().all(&gone)).collect()
}

/// A rectangle of n x m pairs of triangles, seen from +z.
pub(crate) fn sheet([x, y]: [f64; 2], [n, m]: [usize; 2]) -> Soup {
    let at = |i: usize, j: usize| [x * i as f64 / n as f64, y * j as f64 / m as f64, 0.0];
    let cell = |i, j| {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        [[a, b, c], [a, c, d]]
    };
    (0..n)
        .flat_map(|i| (0..m).flat_map(move |j| cell(i, j)))
        .collect()
}

/// Numbers in [-1, 1], the same in every run.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new() -> Self {
        Self(0x9e37_79b9_7f4a_7c15)
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Every corner of every triangle by itself, at most `amplitude` along each axis.
    pub(crate) fn on(mut self, soup: Soup, amplitude: f64) -> Soup {
        mapped(soup, |p| p.map(|c| c + amplitude * self.next()))
    }
}
