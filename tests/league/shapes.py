"""Parts as unions of convex pieces, and the closed mesh of each union. Metres; every part has its own frame.

Pieces overlap where that keeps the seams between them off concave corners: engines that take convex pieces then feel no
edges that the part does not have, and the oracle meets none either.
"""

from dataclasses import dataclass, field

import manifold3d
import numpy as np
from scipy.spatial import ConvexHull


@dataclass
class Part:
    """`pieces`: vertices of convex pieces; `vertices`, `faces`: the closed mesh of their union; `planes`: per piece n, d of n.x <= d."""

    pieces: list
    solid: manifold3d.Manifold | None = None  # where the mesh is made another way than by uniting the pieces
    vertices: np.ndarray = field(init=False)
    faces: np.ndarray = field(init=False)
    planes: list = field(init=False)

    def __post_init__(self):
        union = united(self.pieces)
        if self.solid is not None:
            assert abs(union.volume() / self.solid.volume() - 1) < 1e-9, "the pieces are not the solid"
        mesh = (self.solid or union).to_mesh64()
        self.vertices, self.faces = np.asarray(mesh.vert_properties)[:, :3].copy(), np.asarray(mesh.tri_verts).copy()
        hulls = [ConvexHull(piece) for piece in self.pieces]
        self.pieces = [hull.points[hull.vertices] for hull in hulls]
        self.planes = [np.unique(np.round(hull.equations, 9), axis=0) for hull in hulls]

    def write(self, path):
        write_obj(path, self.vertices, self.faces)


def united(pieces):
    hulls = [manifold3d.Manifold.hull_points(np.asarray(piece)) for piece in pieces]
    return manifold3d.Manifold.batch_boolean(hulls, manifold3d.OpType.Add) if len(hulls) > 1 else hulls[0]


def write_obj(path, vertices, faces):
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")


def hull_faces(piece):
    """Triangles of a convex piece, outward."""
    hull = ConvexHull(piece)
    faces = hull.simplices.copy()
    a, b, c = (piece[faces[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return faces


def box(hx, hy, hz, centre=(0, 0, 0)):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    return corners * [hx, hy, hz] + np.asarray(centre)


def extruded(outline, half):
    """A convex outline in x, y along z."""
    outline = np.asarray(outline, float)
    return np.vstack([np.column_stack([outline, np.full(len(outline), z)]) for z in (-half, half)])


def ring(radius, sides, phase=0.0):
    angle = phase + 2 * np.pi * np.arange(sides) / sides
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def ball(radius, subdivisions=3):
    import trimesh

    return np.asarray(trimesh.creation.icosphere(subdivisions, radius).vertices)


def clipped(outline, normal, offset):
    """The part of a convex outline with normal . x >= offset."""
    kept, height = [], outline @ normal - offset
    for i, point in enumerate(outline):
        j = (i + 1) % len(outline)
        if height[i] >= 0:
            kept.append(point)
        if height[i] * height[j] < 0:
            kept.append(point + (outline[j] - point) * height[i] / (height[i] - height[j]))
    return np.array(kept)


def block_with_convex_hole(outline, outer, half):
    """A block with a hole of a convex outline (anticlockwise): for each side of the hole, all of the block beyond it."""
    pieces = []
    for i, a in enumerate(outline):
        side = outline[(i + 1) % len(outline)] - a
        normal = np.array([side[1], -side[0]]) / np.hypot(*side)
        pieces.append(extruded(clipped(outer, normal, normal @ a), half))
    return Part(pieces, united([extruded(outer, half)]) - united([extruded(outline, 1.1 * half)]))


def toothed(teeth, root, tip, root_share, tip_share):
    """An outline with trapezoid teeth, anticlockwise: root, tip, tip, root of each tooth; shares of the pitch."""
    pitch, points = 2 * np.pi / teeth, []
    for k in range(teeth):
        for radius, share in ((root, -root_share), (tip, -tip_share), (tip, tip_share), (root, root_share)):
            angle = k * pitch + share * pitch / 2
            points.append([radius * np.cos(angle), radius * np.sin(angle)])
    return np.array(points)


def toothed_part(outline, half):
    """A core, and each tooth with its flanks carried on into the core to the axis' side."""
    teeth = outline.reshape(-1, 4, 2)
    pieces = [extruded(teeth[:, [0, 3]].reshape(-1, 2), half)]
    for root_a, tip_a, tip_b, root_b in teeth:
        inner = [root + 0.25 * (root - tip) for root, tip in ((root_a, tip_a), (root_b, tip_b))]
        pieces.append(extruded([inner[0], tip_a, tip_b, inner[1]], half))
    return Part(pieces)


def toothed_hole(outline, outer_radius, half):
    """A round block with a toothed hole: each land inside, with its flanks carried on outwards, and all beyond each tooth space."""
    outer, pieces = ring(outer_radius, 48), []
    teeth = outline.reshape(-1, 4, 2)
    for k, (_, tip_a, tip_b, root_b) in enumerate(teeth):
        normal = np.array([(tip_b - tip_a)[1], -(tip_b - tip_a)[0]]) / np.hypot(*(tip_b - tip_a))
        pieces.append(extruded(clipped(outer, normal, normal @ tip_a), half))
        after = teeth[(k + 1) % len(teeth)]
        lines = ((tip_b, root_b), (root_b, after[0]), (after[0], after[1]))
        land = outer
        for a, b in lines:
            normal = np.array([(b - a)[1], -(b - a)[0]]) / np.hypot(*(b - a))
            land = clipped(land, normal, normal @ a)
        pieces.append(extruded(land, half))
    return Part(pieces, united([extruded(outer, half)]) - united(toothed_part(outline, 1.1 * half).pieces))


def torus(radius, tube, segments, sides):
    section, angle = ring(tube, sides, np.pi / sides), 2 * np.pi * np.arange(segments) / segments
    out = radius + section[:, 0]
    rings = np.stack([np.cos(angle)[:, None] * out, np.sin(angle)[:, None] * out, np.tile(section[:, 1], (segments, 1))], -1)
    k, i = (grid.ravel() for grid in np.meshgrid(range(segments), range(sides), indexing="ij"))
    corner = lambda a, b: (k + a) % segments * sides + (i + b) % sides
    faces = np.vstack([np.column_stack([corner(0, 0), corner(1, 0), corner(1, 1)]), np.column_stack([corner(0, 0), corner(1, 1), corner(0, 1)])])
    solid = manifold3d.Manifold(manifold3d.Mesh64(rings.reshape(-1, 3), faces.astype(np.uint64)))
    return Part([np.vstack([rings[k - 1], rings[k]]) for k in range(segments)], solid)
