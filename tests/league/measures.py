"""What a run is judged by. J is docs/laboratory.md's without ripple, against the oracle; penetration and the place of the body need no oracle."""

import numpy as np
from scipy.spatial.transform import Rotation

FELT = 0.1  # N
EVERY = 10  # ms: poses looked at for penetration


def judge(scene, trace, truth, poses, wrenches, right):
    """Numbers of one run: `truth` and `poses` as x y z qx qy qz qw, `wrenches` and `right` as force and torque on the hand."""
    j = felt(scene, wrenches, right)
    size, ideal = np.linalg.norm(wrenches[:, :3], axis=1), np.linalg.norm(right[:, :3], axis=1)
    both = (size > FELT) & (ideal > FELT)
    cosine = np.einsum("ij,ij->i", wrenches[:, :3], right[:, :3])[both] / (size * ideal)[both]
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    place = np.linalg.norm(poses[:, :3] - truth[:, :3], axis=1)
    turn = (Rotation.from_quat(poses[:, 3:]) * Rotation.from_quat(truth[:, 3:]).inv()).magnitude()
    place = np.hypot(place, scene.radius * turn)
    depth = np.array([penetration(scene, pose) for pose in poses[::EVERY]])
    row = {
        "j_p95": percentile(j, 95), "j_max": j.max(), "j_share_above_1": (j > 1).mean(),
        "angle_deg_p50": percentile(angle, 50), "angle_deg_p95": percentile(angle, 95),
        "force_error_n_p50": percentile(np.linalg.norm((wrenches - right)[:, :3], axis=1), 50),
        "force_error_n_p95": percentile(np.linalg.norm((wrenches - right)[:, :3], axis=1), 95),
        "torque_error_mnm_p95": 1e3 * percentile(np.linalg.norm((wrenches - right)[:, 3:], axis=1), 95),
        "penetration_um_max": 1e6 * depth.max(), "penetration_um_p95": 1e6 * percentile(depth, 95),
        "place_um_p50": 1e6 * percentile(place, 50), "place_um_p95": 1e6 * percentile(place, 95), "place_um_end": 1e6 * place[-1],
        "axial_n_p95": percentile(np.abs((wrenches - right)[:, scene.axis]), 95) if scene.axis is not None else np.nan,
    }
    return row


def percentile(values, q):
    return float(np.percentile(values, q)) if len(values) else np.nan


def felt(scene, wrenches, right):
    """J of each millisecond."""
    f, g = wrenches[:, :3], right[:, :3]
    size, ideal = np.linalg.norm(f, axis=1), np.linalg.norm(g, axis=1)
    larger = np.maximum(size, ideal)
    both = (size > FELT) & (ideal > FELT)
    cosine = np.einsum("ij,ij->i", f, g) / np.where(both, size * ideal, 1)
    direction = np.where(both, np.degrees(np.arccos(np.clip(cosine, -1, 1))) / 18.4, 0)
    magnitude = np.abs(size - ideal) / np.maximum(0.07 * larger, FELT)
    false = np.where((ideal < 1e-6) | (size < 1e-6), larger / FELT, 0)
    arm = np.linalg.norm(scene.held.vertices, axis=1).max()
    t, u = wrenches[:, 3:], right[:, 3:]
    most = np.maximum(np.linalg.norm(t, axis=1), np.linalg.norm(u, axis=1))
    torque = np.linalg.norm(t - u, axis=1) / np.maximum(0.127 * most, FELT * arm)
    change = np.linalg.norm(np.diff(f, axis=0, prepend=f[:1]), axis=1)
    own = np.linalg.norm(np.diff(g, axis=0, prepend=g[:1]), axis=1)
    own = np.array([own[max(0, k - 5) : k + 6].max() for k in range(len(own))])  # a step of the right answer may come 5 ms early or late
    step = np.maximum(change - own, 0) / np.maximum(0.07 * np.maximum(size, np.roll(size, 1)), FELT)
    return np.max([direction, magnitude, false, torque, step], axis=0)


def penetration(scene, pose):
    """Depth of the deepest of many points of either surface in the other part, m: a lower bound of the true depth."""
    turn = Rotation.from_quat(pose[3:]).as_matrix()
    held, fixed = surface_points(scene.held), surface_points(scene.obstacle)
    return max(deepest(scene.obstacle, held @ turn.T + pose[:3]), deepest(scene.held, (fixed - pose[:3]) @ turn))


def surface_points(part, spacing=0.0015, limit=6000):
    """Vertices, points along edges, points on faces: always the same ones of a part."""
    if not hasattr(part, "_points"):
        corners = part.vertices[part.faces]
        edges = np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
        edges = edges[np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1) > spacing]
        points = [part.vertices]
        for a, b in edges:
            count = int(np.linalg.norm(b - a) / spacing)
            points.append(a + np.linspace(0, 1, min(count, 60) + 2)[1:-1, None] * (b - a))
        points = np.unique(np.round(np.vstack(points), 12), axis=0)
        rng = np.random.default_rng(2)
        if len(points) > limit:
            points = np.vstack([part.vertices, points[rng.choice(len(points), limit, replace=False)]])
        part._points = points
        part._box = part.vertices.min(0), part.vertices.max(0)
    return part._points


def deepest(part, points):
    surface_points(part)
    low, high = part._box
    points = points[((points > low) & (points < high)).all(1)]
    inside, slack = np.zeros(len(points), bool), np.zeros(len(points))
    if len(points) == 0:
        return 0.0
    for piece, planes in zip(part.pieces, part.planes):
        near = np.flatnonzero(((points > piece.min(0)) & (points < piece.max(0))).all(1))
        if len(near):
            depth = -(points[near] @ planes[:, :3].T + planes[:, 3]).max(1)
            within = depth > 1e-10
            inside[near[within]] = True
            slack[near[within]] = np.maximum(slack[near[within]], depth[within])
    if not inside.any():
        return 0.0
    if len(part.pieces) == 1:
        return float(slack.max())
    return float(max(to_surface(part, point) for point in points[inside][np.argsort(-slack[inside])[:40]]))


def to_surface(part, point):
    """Distance of a point from the nearest triangle."""
    from trimesh.triangles import closest_point

    corners = part.vertices[part.faces]
    return np.linalg.norm(closest_point(corners, np.tile(point, (len(corners), 1))) - point, axis=1).min()
