"""`taut.watch` against sessions of `taut serve`. Run by scripts/test-languages; TAUT_PROGRAM is `taut`."""

import http.server
import os
import pathlib
import re
import subprocess
import tempfile
import threading
import unittest

import numpy as np
import taut

WORKBENCH = pathlib.Path(__file__).resolve().parents[2] / "workbench.toml"
TOKEN = "0123456789abcdef0123456789abcdef"
PATIENCE = 60  # s; only a hang takes as long


class Session:
    """`taut serve` of a plain scene on free ports, with a token; `changes` of the workbench file are old and new text, `files` lie beside it. Ended by leaving the block."""

    def __init__(self, duration, changes=(), files=None):
        self.duration, self.changes, self.files = duration, changes, files or {}

    def __enter__(self):
        self.directory = tempfile.TemporaryDirectory()
        place = self.place = pathlib.Path(self.directory.name)
        text = WORKBENCH.read_text()
        for old, new in [
            *self.changes,
            ('scene = "peg-in-a-hole"', 'scene = "sphere-on-plane"'),
            ("quic_port = 4857", "quic_port = 0"),
            ("udp_port = 4858", "udp_port = 0"),
            ("port = 4860", "port = 0"),
            ('# token_file = "observers.token"', f'token_file = "{place}/observers.token"'),
        ]:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        text = re.sub(r"(\[observers\].*\n)enabled = false", r"\1enabled = true", text)
        for name, content in {**self.files, "workbench.toml": text}.items():
            (place / name).write_text(content)
        (place / "observers.token").write_text(TOKEN + "\n")
        (place / "observers.token").chmod(0o600)
        program = os.environ["TAUT_PROGRAM"]
        subprocess.run([program, "keys", "--out", place / "cluster.key"], check=True, capture_output=True)
        serve = [program, "serve", "--no-monitor", "--config", place / "workbench.toml", "--key", place / "cluster.key"]
        self.process = subprocess.Popen(
            [*serve, "--duration", str(self.duration)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        said, self.url, self.server = [], None, None
        for line in self.process.stderr:
            said.append(line)
            if found := re.search(r"serving on (\S+) \(control\)", line):
                self.server = found.group(1)
            if found := re.search(r"observers: (http://[^/]+)/", line):
                self.url = found.group(1)
            if self.url and self.server:
                return self
        raise AssertionError("".join(said))

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(PATIENCE)
        self.process.stderr.close()
        self.directory.cleanup()


class Watch(unittest.TestCase):
    def test_states_come_as_arrays_that_the_method_takes(self):
        with Session(PATIENCE) as session, taut.watch(session.url, TOKEN) as states:
            self.assertEqual(states.hello["scene"], "sphere-on-plane")
            self.assertEqual(states.hello["obstacles"][0]["pose"].shape, (7,))
            taken = [next(states) for _ in range(40)]
            times = [state["t"] for state in taken]
            self.assertEqual(times, sorted(times))
            self.assertGreater(times[-1], times[0])
            sim = taut.Simulation("sphere-on-plane")
            for state in taken:
                (tool,) = state["tools"]
                self.assertAlmostEqual(np.linalg.norm(tool["god_object"][3:]), 1, places=5)
                sim.update(tool["device"])
                self.assertEqual((tool["force"].shape, tool["torque"].shape), ((3,), (3,)))
                self.assertEqual(state["head"]["pose"].shape, (7,))
                self.assertIsInstance(tool["buttons"], list)
            states.close()
            self.assertEqual(list(states), [])

    def test_iterating_ends_with_the_session(self):
        with Session(2) as session:
            count = sum(1 for _ in taut.watch(session.url, TOKEN))
        self.assertGreater(count, 2)

    def test_what_cannot_be_watched_is_said(self):
        with Session(PATIENCE) as session:
            for token in (None, "wrong"):
                with self.assertRaisesRegex(taut.TautError, "refused with 401.*token"):
                    taut.watch(session.url, token)
            with self.assertRaisesRegex(taut.TautError, "no header can carry"):
                taut.watch(session.url, "two\nlines")
            taut.watch(session.url + "/stream", TOKEN).close()
        with self.assertRaisesRegex(taut.TautError, "nobody answers.*enabled = true"):
            taut.watch(session.url, TOKEN)
        for url in ("localhost:4860", "https://localhost:4860", "http://localhost:4860/ws", "http://localhost:port"):
            with self.subTest(url), self.assertRaisesRegex(taut.TautError, "http://HOST:PORT"):
                taut.watch(url)

    def test_another_server_is_no_workbench(self):
        class Pages(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.end_headers()
                self.wfile.write(b"<html>\n")

            def log_message(self, *_):
                pass

        with http.server.HTTPServer(("127.0.0.1", 0), Pages) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            try:
                with self.assertRaisesRegex(taut.TautError, "not the lines of a workbench"):
                    taut.watch(f"http://127.0.0.1:{server.server_port}")
            finally:
                server.shutdown()


if __name__ == "__main__":
    unittest.main(verbosity=2)
