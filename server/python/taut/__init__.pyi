"""The god-object method for Python. Poses: x y z (m) qw qx qy qz, world from body; SI units, world axes."""

from collections.abc import Iterator
from os import PathLike
from typing import Any, Self, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
COLUMNS: list[str]
"""Names of the columns of `replay`."""
SHIPPED_SCENES: list[str]
"""Names that `Simulation` and `replay` take; every other name is the path of a scene file."""

class TautError(ValueError):
    """Input that cannot be used; the text says what, where and what to do."""

@final
class Update:
    """What one update of the god-object did."""

    contacts: int
    """Rows in the constraint set."""
    active: int
    """Rows in the last active set."""
    gap_min: float
    """Smallest distance between the bodies, m; infinite when none is near."""
    kkt: float
    """Worst relative KKT residual of the update's projections."""
    substeps: int
    solver_failures: int
    """Projections without an answer: the body stayed where it was."""
    obstacles_blocked: int
    """Obstacles that did not get to their targets."""
    unfinished: bool
    """The budget ran out before the body was as close as it gets: safe, only not yet closest."""

@final
class Force:
    """The force on the hand."""

    wrench: NDArray[np.float64]
    """Force (N), then torque (N m) about the reference point; world axes, within the scene's limits."""
    active: int
    kkt: float
    solved: bool
    """The answer is certified. Where it is not, the wrench is zero, but between obstacles that move."""
    saturated: bool
    """A limit of force or torque was at work."""

@final
class Simulation:
    """A scene and the two loops of the method on it. Threads may share it: they take turns, without the interpreter's lock."""

    name: str
    stiffness: float
    """Of the coupling at the reference point, N/m."""
    size: float
    """Longest side of the box around the god-object, m."""
    mass: float
    """Of the god-object, kg."""
    obstacles: list[str]
    """Their names, in the order of the scene file."""
    reference_point: NDArray[np.float64]
    """Point at which wrenches act, in the god-object's own frame, m."""
    start: NDArray[np.float64]
    """Pose at which the god-object starts."""
    god_object: NDArray[np.float64]
    """Pose at which the god-object is."""

    def __new__(cls, scene: str, overrides: list[str] = ...) -> Simulation:
        """A shipped scene by its name or a scene file by its path; overrides as `taut --set`: "coupling.k_s=1.0"."""
    def update(self, device: ArrayLike) -> Update:
        """Loop 1: the god-object follows the device's pose as far as the obstacles let it, and never further."""
    def force(self, time: float, device: ArrayLike) -> Force:
        """Loop 2: the force for a device's pose at `time`, s, which never runs back; once per reading of the device."""
    def constraints(self) -> NDArray[np.float64]:
        """One row per constraint: point (m), unit normal from obstacle to god-object, gap (m); seven columns."""
    def move_obstacle(self, index: int, target: ArrayLike) -> None:
        """Sends an obstacle to a pose: it goes there at the next update."""
    def obstacle_pose(self, index: int) -> NDArray[np.float64]:
        """Where an obstacle is."""
    def reset(self) -> None:
        """Back to the start, as if nothing had been stepped."""

@final
class FileReport:
    """What was found about one file; `str` of it is the text of `taut check`."""

    file: str
    good: bool
    summary: str
    problems: list[str]
    notes: list[str]
    triangles: int | None
    watertight: bool | None
    volume: float | None
    """m^3; negative if the surface is inside out."""
    size: tuple[float, float, float] | None
    """Sides of the box around it, m."""
    text: str

def check(path: str | PathLike[str]) -> FileReport:
    """Looks at a mesh, scene, trace or workbench file as `taut check` does. A file that is bad, or missing, is an answer."""

def read_trace(path: str | PathLike[str]) -> NDArray[np.float64]:
    """A trace of the device: one row per sample, time (s) and pose; eight columns."""

def replay(
    scene: str, trace: str | PathLike[str], out: str | PathLike[str] | None = None
) -> NDArray[np.float64]:
    """A trace through a scene: one row per sample, columns as in COLUMNS. `out` gets the bytes that `taut replay` writes."""

class watch(Iterator[dict[str, Any]]):
    """States of a session that runs elsewhere, one after the other as they come, until it ends: `for state in taut.watch(url)`.

    `url` is http://HOST:PORT of the server's [observers]; `token` the text of its token file, where it has one. A state has the fields of
    docs/interoperability.md, with arrays in them: a pose instead of `p` and `q` (`state["tools"][0]["god_object"]`; under `pose` where there are other fields
    beside, as in `head`, `bodies`), and every other vector. Events are not told. Whoever is slow misses states, and is disconnected when it takes nothing for 5 s.
    TautError: the address, the token or the answer is no good, nothing came for 10 s, or the connection broke.
    """

    url: str
    hello: dict[str, Any]
    """Scene, obstacles, screens, frames and rate of the session; poses are arrays here, too."""
    def __init__(self, url: str, token: str | None = None) -> None: ...
    def __iter__(self) -> Self: ...
    def __next__(self) -> dict[str, Any]:
        """The next state."""
    def __enter__(self) -> Self: ...
    def __exit__(self, *_: object) -> None: ...
    def close(self) -> None:
        """Leaves. Iterating ends."""

@final
class push_wrench:
    """A force for the hand of a session that runs elsewhere, as `taut push-wrench` gives it: a robot's sensor, a simulation.

    `server` is HOST:PORT of a server with `[wrench_in]`; `key` the file of a credential of the role force, else the one that TAUT_KEY_FILE names; `node` a name
    of its own in the workbench. It joins a server that was lost again by itself, until it is closed: `with taut.push_wrench(...) as hand`.
    Threads may share it, a fork of the process may not: make one there. TautError: the key, the server or its answer is no good.
    """

    server: str
    sent: int
    """Values sent so far."""
    def __new__(cls, server: str, key: str | PathLike[str] | None = None, node: str = "force") -> Self: ...
    def send(self, wrench: ArrayLike, age: float = 0.0) -> bool:
        """Sends force (N), then torque (N m) on the hand at the reference point, in the axes that `[wrench_in]` names; `age` is the time since it was measured,
        s, 0 to 1. Felt in full for 20 ms from its measurement on, then it fades, and is gone 115 ms after it (`max_age_ms` of the server): send at 50 Hz or more.
        Waits for nothing. False: the server is away, and nothing was sent. TautError: no six finite numbers within 10^6, the server stopped, it was closed, or
        this is a fork of the process that made it.
        """
    def __enter__(self) -> Self: ...
    def __exit__(self, *_: object) -> None: ...
    def close(self) -> None:
        """Leaves: what was sent last fades."""
