"""The right answer: where a frictionless rigid part on a six-axis spring comes to rest.

For each device pose the part's pose x minimises the energy of the spring, |x - device|^2 in the metric diag(1, radius^2), subject to:
no convex piece of the part runs into a convex piece of the obstacle. Two convex pieces are apart if and only if a plane lies between
them, so the planes are unknowns beside the pose: a programme in 6 + 3 unknowns for each near pair of pieces, solved by successive
quadratic programmes (quadprog: Goldfarb and Idnani) within a trust region, from the answer of the sample before. There is no
distance, no feature, no bounding-volume tree, no time of impact and no row of contact in it. Millimetres and newtons inside.
"""

import numpy as np
import quadprog
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

NEAR = 1.0  # mm: pieces whose boxes are nearer have a plane
ROW = 1.6  # mm: vertices nearer to a plane have a row; more than a trust region's motion
LEVER = 10.0  # mm: scale of a plane's rotation
TOUCH = 1e-7  # mm: a plane that is wrong by less still separates
SETTLED = 2e-5  # mm: 20 micronewtons
MAX_ROUNDS = 40


class Oracle:
    def __init__(self, scene, trust=0.1):
        self.radius, self.trust = scene.radius * 1e3, trust
        self.held = [piece * 1e3 for piece in scene.held.pieces]
        self.fixed = [piece * 1e3 for piece in scene.obstacle.pieces]
        self.held_faces = exposed_faces(scene.held)
        self.fixed_faces = exposed_faces(scene.obstacle)
        self.low = np.array([piece.min(0) for piece in self.fixed])
        self.high = np.array([piece.max(0) for piece in self.fixed])
        self.normals, self.active = {}, {}
        self.worst = 0.0  # mm: deepest overlap of any answer
        self.unsettled = 0  # answers whose last round still moved

    def start(self, p, quaternion):
        self.p, self.q = p * 1e3, Rotation.from_quat(quaternion)

    def follow(self, p, quaternion):
        """The pose at rest for this pose of the device; metres and a quaternion x y z w."""
        target, rotation = p * 1e3, Rotation.from_quat(quaternion)
        trust, before = self.trust, np.zeros(6)
        for _ in range(MAX_ROUNDS):
            step = self.round(target, rotation, trust)
            if np.abs(step).max() < SETTLED:
                break
            trust = 0.5 * min(trust, np.abs(step).max()) if step @ before < 0 else trust
            before = step
        else:
            self.unsettled += 1
        self.worst = max(self.worst, self.overlap)
        return self.p * 1e-3, self.q.as_quat()

    def pairs(self, vertices):
        for i, points in enumerate(vertices):
            apart = np.maximum(self.low - points.max(0), points.min(0) - self.high).max(1)
            for j in np.flatnonzero(apart < NEAR):
                yield i, int(j)

    def normal(self, key, a, b):
        """From obstacle to part: the first that separates of the pair's own where it was at work, one at work elsewhere, a face's, the last."""
        apart = lambda n: (a @ n.T).min(0) - (b @ n.T).max(0)
        if key in self.active and apart(self.active[key]) > -TOUCH:
            return self.active[key]
        others = np.array([n for other, n in self.active.items() if other != key]).reshape(-1, 3)
        faces = np.vstack([-self.held_faces[key[0]] @ self.q.as_matrix().T, self.fixed_faces[key[1]]])
        if len(faces) > 200 and key in self.normals:  # a finely faceted body: the faces about
            faces = faces[faces @ self.normals[key] > 0.95]
        for candidates in (others, faces):
            if len(candidates):
                margin = apart(candidates)
                if margin.max() > -TOUCH:
                    return candidates[np.argmax(margin)]
        return self.normals[key] if key in self.normals else between(a, b)

    def round(self, target, rotation, trust):
        matrix = self.q.as_matrix()
        vertices = [piece @ matrix.T + self.p for piece in self.held]
        wish = np.concatenate([target - self.p, self.radius * (rotation * self.q.inv()).as_rotvec()])
        rows, planes, self.overlap = [], [], 0.0
        for key in self.pairs(vertices):
            a, b = vertices[key[0]], self.fixed[key[1]]
            n = self.normal(key, a, b)
            planes.append((key, n))
            height_a, height_b = a @ n, b @ n
            c = 0.5 * (height_a.min() + height_b.max())
            if height_a.min() - height_b.max() > 2 * ROW:
                self.normals[key] = n
                planes.pop()
                continue
            self.overlap = max(self.overlap, height_b.max() - height_a.min())
            t1, t2 = tangents(n)
            near_a, near_b = a[height_a - c < ROW], b[c - height_b < ROW]
            origin = a[np.argmin(height_a)]
            at = 6 + 3 * (len(planes) - 1)
            for points, sign in ((near_a, 1.0), (near_b, -1.0)):
                block = np.zeros((len(points), at + 3))
                arm = points - origin
                if sign > 0:
                    block[:, :3] = n
                    block[:, 3:6] = cross(points - self.p, n) / self.radius
                block[:, at] = sign * (arm @ t1) / LEVER
                block[:, at + 1] = sign * (arm @ t2) / LEVER
                block[:, at + 2] = -sign
                rows.append((block, sign * (c - points @ n)))
        size = 6 + 3 * len(planes)
        weight = np.concatenate([np.ones(6), np.full(size - 6, 1e-4)])
        limit = np.full(size, np.inf)
        limit[:6] = trust
        bounded = np.eye(size)[:6]
        matrix_rows = [np.hstack([block, np.zeros((len(block), size - block.shape[1]))]) for block, _ in rows]
        g = np.vstack([*matrix_rows, bounded, -bounded])
        h = np.concatenate([*[side for _, side in rows], -limit[:6], -limit[:6]])
        aim = np.concatenate([wish, np.zeros(size - 6)])
        z, multipliers = solved(weight, aim, g, h)
        self.active, at = {}, 0
        for k, (key, n) in enumerate(planes):
            t1, t2 = tangents(n)
            turned = n + (z[6 + 3 * k] * t1 + z[7 + 3 * k] * t2) / LEVER
            self.normals[key] = turned / np.linalg.norm(turned)
            count = len(rows[2 * k][1]) + len(rows[2 * k + 1][1])
            if multipliers[at : at + count].max(initial=0.0) > 1e-9:
                self.active[key] = self.normals[key]
            at += count
        self.p = self.p + z[:3]
        self.q = Rotation.from_rotvec(z[3:6] / self.radius) * self.q
        return z[:6]


def solved(weight, aim, g, h):
    """The quadratic programme; where rounding has left no feasible point, rows give way by as little as helps."""
    for give in (0.0, 1e-9, 1e-7, 1e-5, 1e-3):
        try:
            answer = quadprog.solve_qp(np.diag(weight), weight * aim, g.T, h - give)
            return answer[0], answer[4]
        except ValueError:
            continue
    raise RuntimeError("the oracle has no feasible step")


def tangents(n):
    helper = np.eye(3)[np.argmin(np.abs(n))]
    t1 = cross(n, helper)
    t1 /= np.linalg.norm(t1)
    return t1, cross(n, t1)


def cross(a, b):
    """a x b; numpy's own is slow for few rows."""
    return a @ np.array([[0, -b[2], b[1]], [b[2], 0, -b[0]], [-b[1], b[0], 0]])


def between(a, b):
    """Unit vector from the nearest point of hull b to that of hull a: non-negative least squares over both hulls."""
    scale, one = 1e4, np.zeros(len(a) + len(b))
    one[: len(a)] = scale
    system = np.vstack([np.hstack([a.T, -b.T]), one, scale * (one == 0)])
    weights, _ = nnls(system, np.array([0, 0, 0, scale, scale]))
    apart = weights[: len(a)] @ a / weights[: len(a)].sum() - weights[len(a) :] @ b / weights[len(a) :].sum()
    return apart / np.linalg.norm(apart)


def exposed_faces(part):
    """Outward normals of each piece's faces that are no seam: some point of the face lies in no other piece."""
    rng, out = np.random.default_rng(1), []
    inside = lambda planes, points: (points @ planes[:, :3].T + planes[:, 3] < 1e-9).all(1)
    for k, (points, planes) in enumerate(zip(part.pieces, part.planes)):
        keep = []
        near = [p for j, p in enumerate(part.planes) if j != k and _boxes_meet(part.pieces[j], points)]
        for plane in planes:
            corners = points[np.abs(points @ plane[:3] + plane[3]) < 1e-9]
            shares = rng.dirichlet(np.ones(len(corners)), 40)
            probes = shares @ corners + 1e-7 * plane[:3]
            covered = np.zeros(len(probes), bool)
            for other in near:
                covered |= inside(other, probes)
            if not covered.all():
                keep.append(plane[:3])
        out.append(np.array(keep).reshape(-1, 3))
    return out


def _boxes_meet(a, b):
    return (a.min(0) <= b.max(0) + 1e-9).all() and (b.min(0) <= a.max(0) + 1e-9).all()


def answers(scene, which, finer=1, trust=0.1):
    """Poses at rest for every millisecond of a hand, and how deep and how unsettled the worst was. `finer`: solves a millisecond."""
    trace = scene.trace(which, 1000.0 * finer)
    oracle = Oracle(scene, trust)
    oracle.start(trace[0, 1:4], trace[0, 4:])
    poses = [np.concatenate(oracle.follow(row[1:4], row[4:])) for row in trace]
    return np.array(poses[::finer]), oracle.worst * 1e-3, oracle.unsettled


def wrench(scene, trace, poses):
    """Force (N) and torque (N m) of the spring on the hand at rest: what a device would render."""
    force = 1000.0 * (poses[:, :3] - trace[:, 1:4])
    turn = (Rotation.from_quat(poses[:, 3:]) * Rotation.from_quat(trace[:, 4:]).inv()).as_rotvec()
    return np.column_stack([force, 1000.0 * scene.radius**2 * turn])
