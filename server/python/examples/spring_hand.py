"""A simulated hand: a grip of 0.2 kg that a spring draws down in three seconds. Run it: taut demo --device python:spring_hand.py,scale=4"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # what an editor knows; the file runs without the wheel
    from taut.device import Info, Sample, Wrench


class Device:
    def open(self, options: dict[str, str]) -> None:
        self.depth = float(options.pop("depth", 0.03))  # m
        if options:
            raise ValueError(f"the option is depth, not {', '.join(options)}")
        self.height = self.speed = self.force = 0.0  # m, m/s, N
        self.opened = self.then = time.monotonic()

    def info(self) -> Info:
        return {
            "name": "spring hand",
            "sensed_degrees_of_freedom": 3,
            "actuated_degrees_of_freedom": 3,
            "max_force": 5.0,  # N
            "max_stiffness": 1000.0,  # N/m
        }

    def read(self) -> Sample | None:
        now = time.monotonic()
        step = min(now - self.then, 0.002)  # s: a pause does not throw the hand
        self.then = now
        sunk = self.depth * min((now - self.opened) / 3, 1)
        pulled = self.force + 100 * (-sunk - self.height) - 8 * self.speed
        self.speed += pulled / 0.2 * step
        self.height += self.speed * step
        return {"position": (0, 0, self.height), "velocity": (0, 0, self.speed)}

    def write(self, wrench: Wrench) -> None:
        self.force = wrench[2]

    def close(self) -> None:
        self.force = 0.0
