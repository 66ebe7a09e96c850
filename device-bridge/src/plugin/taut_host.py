"""Calls a device in Python for taut: an answer to each request on the socket that is standard input (frame.rs).

Whatever the file does, its device gets a zero wrench and `close`: when it raises, when it is interrupted because it hangs, and when
nobody is at the other end any more. Without a request for 20 ms it gets the zero, too.
"""

import gc
import importlib.machinery
import importlib.util
import os
import signal
import socket
import struct
import sys
import traceback

REQUEST = struct.Struct("<c6d")
ANSWER = struct.Struct("<BI")
SAMPLE = struct.Struct("<14d2I")
INFO = struct.Struct("<64s2I5d")
GOOD, NOTHING_NEW, NOT_READY, IS_INFO, IS_ERROR = 0, 1, 2, 10, 11
HOLDS = 0.02  # s without a request after which the wrench is zero
MAX_TEXT = 8000  # bytes of an error: its end says most
NAN = float("nan")
NO_WRENCH = (0.0,) * 6
METHODS = ("open", "info", "read", "write", "close")
SAMPLE_KEYS = {"ready", "position", "orientation", "velocity", "angular_velocity", "age", "buttons"}
INFO_KEYS = {
    "name", "sensed_degrees_of_freedom", "actuated_degrees_of_freedom", "max_force", "max_torque", "max_stiffness",
    "max_rotational_stiffness", "rate",
}  # fmt: skip


def load(path):
    """An object of the class Device in the file."""
    loader = importlib.machinery.SourceFileLoader("taut_device", path)
    spec = importlib.util.spec_from_file_location("taut_device", path, loader=loader)
    module = importlib.util.module_from_spec(spec)
    sys.modules["taut_device"] = module
    loader.exec_module(module)
    device = getattr(module, "Device", None)
    lacking = [name for name in METHODS if not callable(getattr(device, name, None))]
    if not isinstance(device, type) or lacking:
        raise TypeError(f"{path} needs a class Device with {', '.join(METHODS)}; it lacks {', '.join(lacking) or 'the class'}")
    return device()


def known(said, keys, what):
    if not said.keys() <= keys:
        raise ValueError(f"{what} gives {sorted(said.keys() - keys)}; it may give {sorted(keys)}")


def numbers(said, key, count):
    try:
        values = [float(value) for value in said[key]]
    except KeyError:
        raise ValueError(f"read gives no {key}") from None
    if len(values) != count:
        raise ValueError(f"read gives {len(values)} numbers as {key}, and {count} are it")
    return values


def sample(said, with_orientation):
    """The answer to a read."""
    if said is None:
        return answer(NOTHING_NEW)
    if not hasattr(said, "keys"):
        raise TypeError(f"read gives {type(said).__name__}; it may give a dictionary, or None for nothing new")
    known(said, SAMPLE_KEYS, "read")
    if not said.get("ready", True):
        return answer(NOT_READY)
    turns = "angular_velocity" in said
    buttons = int(said.get("buttons", 0))
    if not 0 <= buttons <= 0xFFFF:
        raise ValueError(f"read gives {buttons} as buttons, and there are 16")
    return answer(
        GOOD,
        SAMPLE.pack(
            *numbers(said, "position", 3),
            *(numbers(said, "orientation", 4) if with_orientation else (NAN,) * 4),
            *numbers(said, "velocity", 3),
            *(numbers(said, "angular_velocity", 3) if turns else (NAN,) * 3),
            float(said.get("age", 0.0)),
            buttons,
            turns,
        ),
    )


def information(said):
    known(said, INFO_KEYS, "info")
    return INFO.pack(
        str(said.get("name", "")).encode()[:63],
        int(said["sensed_degrees_of_freedom"]),
        int(said["actuated_degrees_of_freedom"]),
        *(float(said.get(key, NAN)) for key in ("max_force", "max_torque", "max_stiffness", "max_rotational_stiffness")),
        float(said.get("rate", 1000.0)),
    )


def answer(code, content=b""):
    return ANSWER.pack(code, len(content)) + content


class Host:
    def __init__(self, link):
        self.link = link
        self.part = b""
        self.device = None
        self.has_motors = False

    def run(self, path, is_fifo, options):
        device = load(path)
        self.device = device
        device.open(dict(option.split("=", 1) for option in options))
        said = device.info()
        content = information(said)
        with_orientation = said["sensed_degrees_of_freedom"] == 6
        self.has_motors = said["actuated_degrees_of_freedom"] > 0
        if is_fifo:
            schedule("SCHED_FIFO", 1)
        # What is there now is not looked through again.
        gc.collect()
        gc.freeze()
        self.link.sendall(answer(IS_INFO, content))
        is_zero, let_go = True, False
        while True:
            try:
                request = self.request()
            except socket.timeout:
                if self.has_motors and not is_zero:
                    device.write(NO_WRENCH)
                    is_zero = let_go = True
                continue
            if request is None:
                return  # nobody is there any more
            what, *wrench = REQUEST.unpack(request)
            if what == b"R":
                self.link.sendall(sample(device.read(), with_orientation))
            elif what == b"W" and let_go:
                # It was made for a hand that feels the last one. Told, the other end begins again at zero.
                let_go = False
                self.link.sendall(answer(NOTHING_NEW))
            elif what == b"W":
                is_zero = not any(wrench)
                device.write(tuple(wrench))
                self.link.sendall(answer(GOOD))
            else:
                return

    def request(self):
        while len(self.part) < REQUEST.size:
            more = self.link.recv(REQUEST.size - len(self.part))
            if not more:
                return None
            self.part += more
        whole, self.part = self.part, b""
        return whole

    def close(self):
        """Zero and close, the one even if the other fails. Returns what went wrong."""
        device, self.device = self.device, None
        went_wrong = ""
        if device is None:
            return went_wrong
        for call in (lambda: device.write(NO_WRENCH) if self.has_motors else None, device.close):
            try:
                call()
            except BaseException as error:
                went_wrong += told(error)
        return went_wrong


def told(error):
    """The traceback without the lines of this program."""
    lines = traceback.TracebackException.from_exception(error)
    chain = lines
    while chain is not None:
        own = [frame for frame in chain.stack if not frame.filename.startswith("<")]
        chain.stack = traceback.StackSummary.from_list(own)
        chain = chain.__cause__ or chain.__context__
    return "".join(lines.format())


def schedule(name, priority):
    try:
        os.sched_setscheduler(0, getattr(os, name), os.sched_param(priority))
    except (AttributeError, OSError):
        pass  # not on this system, or not for this user


def main(path, is_fifo, *options):
    link = socket.socket(fileno=os.dup(0))
    link.settimeout(HOLDS)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    schedule("SCHED_OTHER", 0)
    sys.dont_write_bytecode = True
    sys.path[:] = [os.path.dirname(path)] + [folder for folder in sys.path if folder]
    sys.argv = [path]
    host = Host(link)
    went_wrong = ""
    try:
        host.run(path, is_fifo == "fifo", options)
    except BaseException as error:
        went_wrong = told(error)
    closing = host.close()
    if closing:
        went_wrong += "and while it was closed:\n" + closing
    try:
        content = went_wrong.encode("utf-8", "replace")[-MAX_TEXT:]
        link.sendall(answer(IS_ERROR, content) if content else answer(GOOD))
    except OSError:
        pass  # nobody is there any more
    os._exit(0)  # whatever threads the file has


main(*sys.argv[1:])
