"""The scenes: two parts, and hands by formula. Lengths in metres, frames: obstacle fixed in the world, the held part's origin is
where the device holds it. A hand goes through via points with minimum jerk, so it starts and stops without a step of force."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import shapes
from shapes import Part, box, extruded, ring

STIFFNESS = 1000.0  # N/m of the coupling, in every method


@dataclass
class Scene:
    name: str
    held: Part
    obstacle: Part
    radius: float  # m: rotational stiffness is STIFFNESS * radius^2, and so is inertia over mass
    vias: dict  # "train" and "judge": rows of t (s), x y z (mm), rotation vector (degrees)
    clearance: float | None = None  # m per side, where the fit is tight: told to whoever takes it
    axis: int | None = None  # along which nothing but the end of the hole could push

    def trace(self, which, rate=1000.0):
        """t, x y z, qx qy qz qw at `rate`."""
        vias = np.array(self.vias[which], float)
        t = np.arange(0.0, vias[-1, 0] + 1e-9, 1 / rate)
        k = np.clip(np.searchsorted(vias[:, 0], t, "right") - 1, 0, len(vias) - 2)
        s = np.clip((t - vias[k, 0]) / (vias[k + 1, 0] - vias[k, 0]), 0, 1)
        s = (s**3 * (10 - 15 * s + 6 * s * s))[:, None]
        six = vias[k, 1:] + s * (vias[k + 1, 1:] - vias[k, 1:])
        quaternion = Rotation.from_rotvec(np.radians(six[:, 3:])).as_quat()
        return np.column_stack([t, six[:, :3] * 1e-3, quaternion])


def path(rows, scale=1.0, mirror=(1, 1, 1), base=0.0, pace=1.0):
    """Rows of duration, x y z, rx ry rz to rows of time; mirrored and scaled in x, y and rotation for training."""
    out, t = [], 0.0
    m = np.array(mirror, float)
    for duration, *six in rows:
        t += duration * pace
        six = np.array(six, float)
        six[:3] *= m * [scale, scale, 1]
        six[3:] *= m.prod() * m * scale
        six[2] += base
        out.append([t, *six])
    return out


def both(rows, base=0.0):
    """The judged hand, and the one for training: mirrored, smaller to the sides and faster."""
    return {"judge": path(rows, base=base), "train": path(rows, 0.7, (-1, 1, 1), base, 0.5)}


def insertion(top, deep, push, tilt, twist):
    """Into a hole along z, pushed to all sides, tilted and turned there, pulled with a push on, pushed again, and out."""
    return [
        (0.0, 0, 0, top, 0, 0, 0), (0.8, 0, 0, deep, 0, 0, 0), (0.2, push, 0, deep, 0, 0, 0), (0.3, 0, push, deep, 0, 0, 0),
        (0.2, 0, 0, deep, 0, 0, 0), (0.2, 0, 0, deep, tilt, 0, 0), (0.3, 0, 0, deep, 0, -tilt, 0), (0.2, 0, 0, deep, 0, 0, twist),
        (0.3, -push, push / 2, deep, tilt / 2, 0, 0), (0.4, -push, push / 2, deep + 8, tilt / 2, 0, 0), (0.3, 0, -push, deep, 0, 0, 0),
        (0.2, 0, 0, deep, 0, 0, 0), (0.6, 0, 0, top, 0, 0, 0),
    ]


def peg(name, clearance, push=2.0, tilt=3.0):
    sides = 32
    held = Part([extruded(ring(0.010, sides), 0.020)])
    hole = ring((0.010 + clearance) / np.cos(np.pi / sides), sides)
    block = shapes.block_with_convex_hole(hole, ring(0.030, sides), 0.020)
    return Scene(name, held, block, 0.012, both(insertion(44, 12, push, tilt, 6)), clearance, 2)


def toothed(name, teeth, root, tip, root_share, tip_share, play, twist):
    held = shapes.toothed_part(shapes.toothed(teeth, root, tip, root_share, tip_share), 0.010)
    wider = shapes.toothed(teeth, root + play, tip + play, root_share + 0.02, tip_share + 0.02)
    hole = shapes.toothed_hole(wider, tip + 0.012, 0.010)
    return Scene(name, held, hole, 0.012, both(insertion(24, 8, 1.5, 2, twist)), 1e-4, 2)


def all_scenes():
    plate = Part([box(0.1, 0.1, 0.01, (0, 0, -0.01))])
    press = [
        (0, 0, 0, 14, 0, 0, 0), (0.4, 0, 0, 5, 0, 0, 0), (0.4, 20, 0, 5, 0, 0, 20), (0.4, 20, 15, 6, 4, 0, 20), (0.4, -10, 15, 7, 0, -4, -30),
        (0.4, -10, -5, 4, 3, 3, 0), (0.4, 0, 0, 14, 0, 0, 0),
    ]
    corner = Part([box(0.06, 0.06, 0.01, (0.05, 0.05, -0.01)), box(0.01, 0.06, 0.06, (-0.01, 0.05, 0.04)), box(0.06, 0.01, 0.06, (0.05, -0.01, 0.04))])
    into = [
        (0, 22, 22, 22, 0, 0, 0), (0.5, 7, 8, 6, 0, 0, 0), (0.4, 12, 5, 7, 5, 0, 0), (0.4, 5, 12, 6, 0, 5, 8), (0.4, 6, 6, 6, 0, 0, -10),
        (0.4, 7, 7, 14, 4, -4, 0), (0.4, 22, 22, 22, 0, 0, 0),
    ]
    groove = Part([
        np.vstack([extruded([(0, 0), (s * 0.04, 0.04), (s * 0.04, -0.02), (0, -0.02)], 0.06)[:, [2, 0, 1]]]) for s in (1, -1)
    ])
    along = [
        (0, 0, 0, 26, 0, 0, 0), (0.5, 0, 0, 10, 0, 0, 0), (0.4, 20, 0, 10, 0, 0, 0), (0.4, 20, 4, 11, 30, 0, 0), (0.4, 0, -4, 10, 30, 4, 0),
        (0.4, -15, 0, 9, 0, 0, 5), (0.4, 0, 0, 26, 0, 0, 0),
    ]
    round_trip = [
        (0, 0, 0, 50, 0, 0, 0), (0.4, 0, 0, 41, 0, 0, 0), (0.4, 12, 0, 39, 0, 10, 0), (0.5, 0, 14, 38, 0, 0, 0), (0.5, -14, 2, 37, 0, -10, 20),
        (0.4, 0, 0, 41, 0, 0, 0), (0.4, 0, 0, 50, 0, 0, 0),
    ]
    slot = np.array([(-8.1, -5.1), (8.1, -5.1), (8.1, 5.1), (-8.1, 5.1)]) * 1e-3
    bar = Part([extruded(ring(0.008, 16), 0.06)])
    hang = [
        (0, 0, 0, 0, 0, 0, 0), (0.5, 0, -11, 0, 0, 0, 0), (0.4, 0, -11, 15, 0, 0, 20), (0.4, 8, -10, 15, 0, 0, 40), (0.4, 0, -11, -15, 8, 0, 0),
        (0.4, -9, -6, 0, 0, 10, 0), (0.5, 0, 0, 0, 0, 0, 0),
    ]
    sheet = Part([box(0.1, 0.1, 0.00005)])
    through = [
        (0, 0, 0, 25, 0, 0, 0), (0.25, 0, 0, -6, 0, 0, 0), (0.4, 15, 0, -8, 3, 0, 0), (0.4, 0, 10, -4, 0, 6, 30), (0.4, 0, 0, 6, 0, 0, 0), (0.3, 0, 0, 25, 0, 0, 0),
    ]
    jack = Part([box(0.015, 0.004, 0.004), box(0.004, 0.015, 0.004), box(0.004, 0.004, 0.015)])
    step = Part([box(0.04, 0.06, 0.01, (-0.04, 0, 0.0)), box(0.04, 0.06, 0.01, (0.039, 0, -0.008))])
    tumble = [
        (0, 5, 0, 30, 0, 0, 0), (0.4, -5, 0, 21, 10, 10, 0), (0.5, 10, 5, 18, 20, 15, 0), (0.5, 14, -5, 10, 0, 25, 10), (0.5, 8, 0, 12, -20, 0, 30),
        (0.5, -8, 0, 20, 0, 0, 0), (0.4, 5, 0, 30, 0, 0, 0),
    ]
    return [
        Scene("box on plane", Part([box(0.02, 0.015, 0.01)]), plate, 0.012, both(press)),
        Scene("box in corner", Part([box(0.01, 0.01, 0.01)]), corner, 0.008, both(into) | {"train": path(into, 1, (1, 1, 1), -1.0, 0.5)}),
        Scene("cylinder in groove", Part([extruded(ring(0.010, 64), 0.02)[:, [2, 0, 1]]]), groove, 0.010, both(along)),
        Scene("ball on ball", Part([shapes.ball(0.015, 4)]), Part([shapes.ball(0.030, 4)]), 0.010, both(round_trip)),
        peg("peg, play 0.5 mm", 5e-4),
        peg("peg, play 0.1 mm", 1e-4),
        peg("peg, play 7 um", 7e-6, 1.5, 2.0),
        Scene("square peg, play 0.1 mm", Part([extruded(slot / 8.1 * 8.1 - np.sign(slot) * 1e-4, 0.02)]),
              shapes.block_with_convex_hole(slot, ring(0.03, 32), 0.02), 0.010, both(insertion(44, 12, 2, 3, 8)), 1e-4, 2),
        toothed("star in star", 5, 0.008, 0.016, 0.55, 0.06, 3e-4, 8),
        toothed("spline of 12 teeth", 12, 0.011, 0.014, 0.55, 0.35, 3e-4, 6),
        Scene("ring on bar", shapes.torus(0.020, 0.005, 32, 10), bar, 0.014, both(hang)),
        Scene("box on thin sheet", Part([box(0.01, 0.01, 0.01)]), sheet, 0.008, both(through)),
        Scene("jack on step", jack, step, 0.009, both(tumble)),
    ]


def wiring():
    """Is an engine connected rightly: a box is pressed 5 mm into a plane, which is 5 N and no torque, and then turned 20 degrees above it."""
    hand = [(0, 0, 0, 14, 0, 0, 0), (0.5, 0, 0, 5, 0, 0, 0), (1.0, 0, 0, 5, 0, 0, 0), (1.5, 0, 0, 25, 10, 15, 20), (2.5, 0, 0, 25, 10, 15, 20)]
    plate = Part([box(0.1, 0.1, 0.01, (0, 0, -0.01))])
    return Scene("wiring", Part([box(0.02, 0.015, 0.01)]), plate, 0.012, {"judge": hand, "train": hand})
