"""`taut.push_wrench` against sessions of `taut serve`. Run by scripts/test-languages; TAUT_PROGRAM is `taut`."""

import os
import pathlib
import subprocess
import sys
import threading
import time
import unittest

import taut
from test_watch import PATIENCE, TOKEN, Session

EXAMPLE = pathlib.Path(__file__).resolve().parents[1] / "examples/robot_loop.py"
DOCUMENT = EXAMPLE.parents[3] / "docs/python.md"
STILL = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.2,1,0,0,0\n1,0,0,0.2,1,0,0,0\n"


class Open(Session):
    """A session that takes a force; its simulated hand stands still far above the plane."""

    def __init__(self, duration):
        super().__init__(
            duration,
            [
                ('# hand = "firm" ', 'hand = "firm" '),
                ('# path = "my-hand.csv"', 'path = "still.csv"'),
                ("tremor = 5e-5", "tremor = 0.0"),
                ('passivity = "observe" ', 'passivity = "control" '),
                ("enabled = false                            # needs safety.passivity", "enabled = true # "),
            ],
            {"still.csv": STILL},
        )

    def __enter__(self):
        super().__enter__()
        program, keys = os.environ["TAUT_PROGRAM"], self.place / "keys"
        made = [program, "keys", "--master", self.place / "cluster.key", "--config", self.place / "workbench.toml", "--out", keys]
        subprocess.run(made, check=True, capture_output=True)
        self.keys = keys
        return self

    def pushing(self, **more):
        return taut.push_wrench(self.server, self.keys / "force.key", **more)

    def felt(self, states, holds):
        """Waits for a state whose force on the hand, N along x, is such."""
        begun, last = time.monotonic(), None
        for state in states:
            last = float(state["tools"][0]["force"][0])
            if holds(last):
                return last
            assert time.monotonic() - begun < PATIENCE, last


class Push(unittest.TestCase):
    def test_the_example_closes_a_loop_and_when_it_is_killed_its_force_is_gone(self):
        _, code = EXAMPLE.read_text().split("\n\n", 1)
        self.assertIn(f"```python\n{code}```", DOCUMENT.read_text())
        with Open(3 * PATIENCE) as session, taut.watch(session.url, TOKEN) as states:
            arguments = [session.url, session.server, session.keys / "force.key", TOKEN]
            robot = subprocess.Popen([sys.executable, EXAMPLE, *arguments])
            try:
                felt = session.felt(states, lambda force: force > 0.5)
                self.assertLess(felt, 2.0)  # 50 N/m, 40 mm
                self.assertIsNone(robot.poll(), "it goes on")
            finally:
                robot.kill()
                robot.wait(PATIENCE)
            session.felt(states, lambda force: force == 0.0)

    def test_what_is_old_when_it_is_sent_is_felt_less_or_not_at_all(self):
        with Open(3 * PATIENCE) as session, taut.watch(session.url, TOKEN) as states, session.pushing() as hand:
            for age, expected in [(0.0, (0.9, 1.1)), (0.07, (0.2, 0.6))]:
                over = threading.Event()

                def push(age=age, over=over):
                    while not over.is_set():
                        self.assertTrue(hand.send([1, 0, 0, 0, 0, 0], age))
                        time.sleep(0.002)

                thread = threading.Thread(target=push)
                thread.start()
                try:
                    if age == 0.0:
                        session.felt(states, lambda force: force > expected[0])
                    else:
                        # What the port damps, and a busy machine's own delay, only lessen it.
                        session.felt(states, lambda force: force < expected[1])
                    most = max(float(next(states)["tools"][0]["force"][0]) for _ in range(30))
                    self.assertLess(most, expected[1])
                finally:
                    over.set()
                    thread.join()
            session.felt(states, lambda force: force == 0.0)
            for _ in range(100):
                self.assertTrue(hand.send([1, 0, 0, 0, 0, 0], age=0.2))
                time.sleep(0.002)
            most = max(float(next(states)["tools"][0]["force"][0]) for _ in range(10))
            self.assertEqual(most, 0.0)
            self.assertGreater(hand.sent, 100)

    def test_what_cannot_be_pushed_is_said(self):
        with Open(PATIENCE) as session:
            with session.pushing() as hand:
                for bad in ([1, 2, 3], [float("nan")] * 6, [float("inf"), 0, 0, 0, 0, 0], [2e6, 0, 0, 0, 0, 0], range(7), [[0] * 6]):
                    with self.subTest(bad), self.assertRaisesRegex(taut.TautError, "is no wrench: give six numbers"):
                        hand.send(bad)
                for age in (-1, 2, float("nan")):
                    with self.subTest(age), self.assertRaisesRegex(taut.TautError, "time since it was measured"):
                        hand.send([0] * 6, age)
                self.assertEqual(hand.sent, 0)
                with self.assertRaisesRegex(taut.TautError, "force source"):
                    session.pushing(node="another")
            with self.assertRaisesRegex(taut.TautError, "was closed"):
                hand.send([0] * 6)
            with self.assertRaisesRegex(taut.TautError, "observer"):
                taut.push_wrench(session.server, session.keys / "observer.key")
            with self.assertRaisesRegex(taut.TautError, "missing.key"):
                taut.push_wrench(session.server, session.keys / "missing.key")
        self.assertIsNone(os.environ.get("TAUT_KEY_FILE"))
        with self.assertRaisesRegex(taut.TautError, "no credential is named"):
            taut.push_wrench(session.server)

    def test_a_fork_cannot_send_in_the_session_of_its_parent(self):
        with Open(3 * PATIENCE) as session, session.pushing() as hand:
            self.assertTrue(hand.send([0] * 6))
            child = os.fork()
            if not child:
                ended = 1  # it could send, or something else was raised
                try:
                    hand.send([0] * 6)
                except taut.TautError as error:
                    hand.close()  # waits for no thread of the parent
                    ended = 0 if "another process" in str(error) else 2
                finally:
                    os._exit(ended)
            self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
            self.assertTrue(hand.send([0] * 6))
            self.assertEqual(hand.sent, 2)

    def test_a_session_that_ends_is_told(self):
        with Open(2) as session, session.pushing() as hand:
            with self.assertRaisesRegex(taut.TautError, "stopped"):
                while True:
                    hand.send([0] * 6)
                    time.sleep(0.01)
            with self.assertRaisesRegex(taut.TautError, "stopped"):
                hand.send([0] * 6)


if __name__ == "__main__":
    unittest.main(verbosity=2)
