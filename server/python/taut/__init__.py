"""The god-object method for Python: scenes, steps with numpy in and out, mesh checks, replay of traces, a session that runs elsewhere: its states, and a force for its hand.

Poses are arrays of seven: x y z of the body's own origin in metres, and the unit quaternion qw qx qy qz, world from body.
SI units and world axes throughout. Input that cannot be used raises TautError.
"""

from ._taut import (
    COLUMNS,
    SHIPPED_SCENES,
    FileReport,
    Force,
    Simulation,
    TautError,
    Update,
    __version__,
    check,
    push_wrench,
    read_trace,
    replay,
)
from ._watch import watch

__all__ = [
    "COLUMNS",
    "SHIPPED_SCENES",
    "FileReport",
    "Force",
    "Simulation",
    "TautError",
    "Update",
    "__version__",
    "check",
    "push_wrench",
    "read_trace",
    "replay",
    "watch",
]
