"""A device that is a simulated hand on a grip, and every way in which one may go wrong; `state` is a file that the test reads and sets."""

import os
import struct
import sys
import time

GOOD, HANGS, NOT_A_NUMBER, LONG_QUATERNION, TOO_HOT, UNPLUGGED, NOTHING_NEW, NOT_CALIBRATED = range(8)
# Python's own ways.
STUBBORN, EXITS, CRASHES, WRONG_SHAPE, UNKNOWN_KEY, PRINTS, WRITES_TO_THE_LINK, WRITE_RAISES = range(8, 16)
PLACES = ["mode", "served", "force", "torque", "after", "closes", "opens", "process", "writes", "jump", "fall"]


class Device:
    def open(self, options):
        self.state = os.open(options.pop("state"), os.O_RDWR)
        if options:
            raise ValueError(f"what options are these? {options}")
        if self.get("mode") == UNPLUGGED:
            raise OSError("no hand is plugged in")
        self.height, self.rising, self.pushed, self.watch = 0.0, 0.0, 0.0, False
        self.set("force", 0)
        self.set("opens", self.get("opens") + 1)
        self.set("process", os.getpid())

    def info(self):
        return {
            "name": "hand in Python",
            "sensed_degrees_of_freedom": 6,
            "actuated_degrees_of_freedom": 6,
            "max_force": 12,
            "max_torque": 0.5,
            "max_stiffness": 1500,
            "max_rotational_stiffness": 2,
        }

    def read(self):
        mode = self.get("mode")
        if mode != GOOD:
            self.watch = True
            self.set("served", self.get("served") + 1)
        if mode == HANGS:
            while self.get("mode") == HANGS:
                time.sleep(0.01)
        while mode == STUBBORN:
            try:
                time.sleep(1)
            except BaseException:
                pass
        if mode == TOO_HOT:
            raise RuntimeError("the motors are too hot")
        if mode == UNPLUGGED:
            raise OSError("the cable is out")
        if mode == NOTHING_NEW:
            return None
        if mode == NOT_CALIBRATED:
            return {"ready": False}
        if mode == EXITS:
            sys.exit("enough")
        if mode == CRASHES:
            os.abort()
        if mode == WRONG_SHAPE:
            return {"position": [0, 0], "orientation": [1, 0, 0, 0], "velocity": [0, 0, 0]}
        if mode == UNKNOWN_KEY:
            return {"postion": [0, 0, 0]}
        if mode == PRINTS:
            print("x" * 100_000)
            print("many words")
        if mode == WRITES_TO_THE_LINK:
            for descriptor in set(range(3, 10)) - {self.state}:
                try:
                    os.write(descriptor, b"\xff" * 200)
                except OSError:
                    pass
        force = self.pushed + 100 * (-0.03 - self.height) - 8 * self.rising
        self.rising += force / 0.2 * 1e-3
        self.height += self.rising * 1e-3
        height = float("nan") if mode == NOT_A_NUMBER else self.height
        length = 1.2 if mode == LONG_QUATERNION else 1.0
        return {
            "position": (0.0, 0.0, height),
            "orientation": (length, 0.0, 0.0, 0.0),
            "velocity": (0.0, 0.0, self.rising),
            "angular_velocity": (0.0, 0.0, 0.0),
            "buttons": 5,
        }

    def write(self, wrench):
        if self.get("mode") == WRITE_RAISES and any(wrench):
            self.set("served", self.get("served") + 1)
            raise RuntimeError("the motors do not listen")
        change = "jump" if wrench[2] else "fall"
        self.set(change, max(self.get(change), int(abs(wrench[2] - self.pushed) * 1e6)))
        self.set("writes", self.get("writes") + 1)
        self.pushed = wrench[2]
        self.set("force", int(wrench[2] * 1e6))
        self.set("torque", int(wrench[3] * 1e6))
        if self.watch:
            self.watch = False
            self.set("after", self.get("force"))

    def close(self):
        if self.get("force") == 0:
            self.set("closes", self.get("closes") + 1)

    def get(self, name):
        return struct.unpack("<q", os.pread(self.state, 8, 8 * PLACES.index(name)))[0]

    def set(self, name, value):
        os.pwrite(self.state, struct.pack("<q", value), 8 * PLACES.index(name))
