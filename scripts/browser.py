"""A headless Chromium, driven by the DevTools protocol over a pipe: for the scripts beside this file.

Needs Python 3 and Chromium (Debian: chromium), no graphics card and no display.
"""

import base64
import json
import os
import select
import shutil
import subprocess
import time

BROWSERS = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"]
FLAGS = [
    "--headless",
    "--no-first-run",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--hide-scrollbars",
    "--mute-audio",
    "--remote-debugging-pipe",
]
# WebGL without a graphics card.
WEBGL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
DEADLINE_S = 30.0  # for one answer of the browser; a busy machine needs seconds


def find(named=None):
    """The browser's program, if there is one."""
    return named or next(filter(None, map(shutil.which, BROWSERS)), None)


class NoPage(RuntimeError):
    """Nothing answers at an address."""


class Browser:
    """A headless browser, driven over two pipes; messages end with a zero byte."""

    def __init__(self, program, size, profile, sandbox, drawing=WEBGL):
        to_browser, self.write_end = os.pipe()
        self.read_end, from_browser = os.pipe()
        command = [program, *FLAGS, *drawing, f"--window-size={size[0]},{size[1]}", f"--user-data-dir={profile}"]
        if not sandbox:
            command.append("--no-sandbox")

        def hand_over_pipes():
            # The browser reads from descriptor 3 and writes to 4; move ours away first.
            ours = os.dup2(to_browser, 30), os.dup2(from_browser, 31)
            os.dup2(ours[0], 3)
            os.dup2(ours[1], 4)

        self.process = subprocess.Popen(
            [*command, "about:blank"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            close_fds=False,
            preexec_fn=hand_over_pipes,
        )
        os.close(to_browser)
        os.close(from_browser)
        self.buffer = b""
        self.next_id = 1
        self.console = []

    def call(self, method, session=None, **parameters):
        """Sends a command and waits for its answer; keeps console errors on the way."""
        message = {"id": self.next_id, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        self.next_id += 1
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + DEADLINE_S
        while time.monotonic() < until:
            answer = self.read(until - time.monotonic())
            if answer is None:
                continue
            if answer.get("id") == message["id"]:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error'].get('message')}")
                return answer["result"]
            self.note(answer)
        raise RuntimeError(f"{method}: the browser did not answer within {DEADLINE_S:.0f} s")

    def listen(self, seconds):
        """Lets the page run."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            message = self.read(until - time.monotonic())
            if message is not None:
                self.note(message)

    def read(self, timeout):
        while b"\0" not in self.buffer:
            if not select.select([self.read_end], [], [], max(timeout, 0))[0]:
                return None
            data = os.read(self.read_end, 1 << 20)
            if not data:
                raise RuntimeError("the browser ended (as root or in a container, try --no-sandbox)")
            self.buffer += data
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def note(self, message):
        parameters = message.get("params", {})
        if message.get("method") == "Runtime.consoleAPICalled" and parameters.get("type") in ("error", "warning"):
            text = " ".join(str(a.get("value", a.get("description", ""))) for a in parameters["args"])
            self.console.append(text.split("\n")[0])
        elif message.get("method") == "Runtime.exceptionThrown":
            self.console.append(str(parameters["exceptionDetails"].get("text")))

    def close(self):
        os.close(self.write_end)  # the browser ends when its pipe does
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.read_end)

    def open(self, address, size):
        """A page of `size` pixels at `address`; its session."""
        target = self.call("Target.createTarget", url="about:blank")
        session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        self.resize(session, size)
        self.call("Runtime.enable", session)
        self.call("Page.enable", session)
        going = self.call("Page.navigate", session, url=address)
        if "errorText" in going:
            raise NoPage(f"the page cannot be opened ({going['errorText']}): is the server running?")
        return session

    def resize(self, session, size, scale=1):
        width, height = size
        self.call(
            "Emulation.setDeviceMetricsOverride",
            session,
            width=width,
            height=height,
            deviceScaleFactor=scale,
            mobile=False,
        )

    def value(self, session, expression):
        """What an expression is worth in the page."""
        answer = self.call("Runtime.evaluate", session, expression=expression, returnByValue=True)
        return answer["result"].get("value")

    def picture(self, session, path):
        shot = self.call("Page.captureScreenshot", session, format="png")
        with open(path, "wb") as file:
            file.write(base64.b64decode(shot["data"]))
