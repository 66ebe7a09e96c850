"""Types of a device in Python, for editors and type checkers: taut bridge --device python:FILE runs a file with a class of this form.

SI units; the device's own axes, right-handed: where nothing is configured x right, y away from the user, z up. The file needs nothing of
this module while it runs. Each call should return within a millisecond; docs/devices.md says what happens to one that does not.
"""

from collections.abc import Sequence
from typing import Protocol, TypedDict

Wrench = tuple[float, float, float, float, float, float]
"""Force (N), then torque (N m), on the hand."""


class _Freedoms(TypedDict):
    sensed_degrees_of_freedom: int
    """3 (position) or 6."""
    actuated_degrees_of_freedom: int
    """0 (no motors), 3 (force) or 6 (force and torque)."""


class Info(_Freedoms, total=False):
    """What the device is: the same after every open."""

    name: str
    max_force: float
    """N, at most 1000; needed with motors, as max_stiffness."""
    max_stiffness: float
    """N/m that it renders without oscillation, at most 1e6."""
    max_torque: float
    """N m, at most 100; needed with 6 actuated, as max_rotational_stiffness."""
    max_rotational_stiffness: float
    """N m/rad, at most 1e4."""
    rate: float
    """Hz at which it may be read and written, 200 to 1e5; 1000 if it is not given. It is called at most 1000 times a second."""


class Sample(TypedDict, total=False):
    """One reading. Without `ready = False`, position and velocity are needed, and with 6 sensed the orientation."""

    ready: bool
    """False: there, but without a pose that may be used (not calibrated, no power)."""
    position: Sequence[float]
    """m, at most 10 along each axis."""
    velocity: Sequence[float]
    """m/s, at most 100 along each axis."""
    orientation: Sequence[float]
    """w x y z, of unit length within 1e-3."""
    angular_velocity: Sequence[float]
    """rad/s, at most 1000; taken from orientations where it is not given."""
    age: float
    """s since it was measured, 0 to 1; from 0.02 on it counts as nothing new."""
    buttons: int
    """Bit 0 the first, 16 at most."""


class Device(Protocol):
    """What the class `Device` of a file has. All calls come from one thread: open, info, then read and write in turn, close."""

    def open(self, options: dict[str, str]) -> None:
        """Finds and prepares the device, without force. It may take 5 s."""

    def info(self) -> Info: ...

    def read(self) -> Sample | None:
        """The newest sample; None where there is no newer one than the last. An exception is a device that is gone."""

    def write(self, wrench: Wrench) -> None:
        """Renders until the next call; not called without motors."""

    def close(self) -> None:
        """After a write of zeros; also after an exception. Not called when the process is killed."""
