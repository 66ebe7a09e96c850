"""The wheel as its user has it. Run by scripts/test-languages, which names the program, the C example and the data.

TAUT_PROGRAM: `taut`, the reference of every replay. TAUT_C_REPLAY: the built C example.
"""

import contextlib
import io
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np
import taut

HERE = pathlib.Path(__file__).resolve().parent
SCENES = HERE.parents[1] / "scenes"
HANDS = {"moving-plate": "moving-plate-hand"}
RATE = 100  # Hz


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


def dense_trace(scene, path):
    """The hand's via points, joined by straight lines and normalised quaternions; at most 6 s."""
    via = taut.read_trace(SCENES / f"{HANDS.get(scene, scene)}.csv")
    lines = ["t,x,y,z,qw,qx,qy,qz"]
    for a, b in zip(via, via[1:]):
        if a[4:] @ b[4:] < 0:
            b = np.concatenate([b[:4], -b[4:]])
        for step in range(round((b[0] - a[0]) * RATE)):
            row = a + step / ((b[0] - a[0]) * RATE) * (b - a)
            row[4:] /= np.linalg.norm(row[4:])
            if row[0] - via[0][0] < 6:
                lines.append(",".join(repr(float(number)) for number in row))
    path.write_text("\n".join(lines) + "\n")


class Replay(unittest.TestCase):
    def test_python_and_c_write_the_bytes_of_taut_replay(self):
        for scene in taut.SHIPPED_SCENES:
            with self.subTest(scene), tempfile.TemporaryDirectory() as name:
                directory = pathlib.Path(name)
                try:
                    taut.Simulation(scene)
                except taut.TautError as error:
                    if scene != "two-bunnies" or os.environ.get("TAUT_REQUIRE"):
                        raise
                    self.skipTest(str(error))
                trace = directory / "trace.csv"
                dense_trace(scene, trace)
                run(os.environ["TAUT_PROGRAM"], "replay", "--scene", scene, "--trace", trace, "--out", directory / "rust.csv")
                expected = (directory / "rust.csv").read_bytes()
                rows = taut.replay(scene, trace, directory / "python.csv")
                self.assertEqual((directory / "python.csv").read_bytes(), expected)
                self.assertEqual(run(os.environ["TAUT_C_REPLAY"], scene, trace), expected)
                force = rows[:, [taut.COLUMNS.index(c) for c in ("fx", "fy", "fz")]]
                self.assertGreater(np.linalg.norm(force, axis=1).max(), 0.1, "the trace touches something")
                self.assertEqual(rows.shape, (expected.count(b"\n") - 1, len(taut.COLUMNS)))

    def test_an_answer_is_not_written_over_what_it_is_made_of(self):
        with tempfile.TemporaryDirectory() as name:
            trace, link = pathlib.Path(name) / "trace.csv", pathlib.Path(name) / "link.csv"
            dense_trace("sphere-on-plane", trace)
            link.symlink_to(trace)
            before = trace.read_bytes()
            for out in (trace, link):
                with self.assertRaisesRegex(taut.TautError, "it is read for this answer"):
                    taut.replay("sphere-on-plane", trace, out)
            with self.assertRaisesRegex(taut.TautError, "cannot be written"):
                taut.replay("sphere-on-plane", trace, pathlib.Path(name) / "nowhere" / "answer.csv")
            self.assertEqual(trace.read_bytes(), before)
            self.assertEqual(len(list(pathlib.Path(name).iterdir())), 2)

    def test_an_answer_is_not_written_over_what_its_scene_names(self):
        with tempfile.TemporaryDirectory() as name:
            scene, way, hand = (pathlib.Path(name) / file for file in ("scene.toml", "way.csv", "hand.csv"))
            scene.write_text(
                'name = "x"\n[god_object]\nshape = { sphere = { radius = 0.01 } }\nmass = 1.0\npose = { position = [0.0, 0.0, 0.1] }\n'
                '[[obstacle]]\nname = "plate"\nshape = { box = { half_extents = [0.1, 0.1, 0.01] } }\nmotion = { trace = "way.csv" }\n'
            )
            for trace, height in (way, 0.0), (hand, 0.1):
                trace.write_text(f"t,x,y,z,qw,qx,qy,qz\n0,0,0,{height},1,0,0,0\n1,0,0,{height},1,0,0,0\n")
            before = way.read_bytes()
            with self.assertRaisesRegex(taut.TautError, "it is read for this answer"):
                taut.replay(str(scene), hand, way)
            self.assertEqual(way.read_bytes(), before)

    def test_a_replay_can_be_interrupted_and_then_writes_nothing(self):
        class Interrupted(Exception):
            pass

        def interrupt(*_):
            raise Interrupted

        with tempfile.TemporaryDirectory() as name:
            trace, out = pathlib.Path(name) / "trace.csv", pathlib.Path(name) / "answer.csv"
            rows = (f"{step},0,0,0.0{step % 9 + 1},1,0,0,0\n" for step in range(200_000))  # seconds of work, and the signal comes at its begin
            trace.write_text("t,x,y,z,qw,qx,qy,qz\n" + "".join(rows))
            before = signal.signal(signal.SIGALRM, interrupt)
            try:
                signal.setitimer(signal.ITIMER_REAL, 0.05)
                with self.assertRaises(Interrupted):
                    taut.replay("sphere-on-plane", trace, out)
            finally:
                signal.setitimer(signal.ITIMER_REAL, 0)
                signal.signal(signal.SIGALRM, before)
            self.assertEqual([file.name for file in pathlib.Path(name).iterdir()], [trace.name])

    def test_the_notebook_runs(self):
        with tempfile.TemporaryDirectory() as name:
            trace = pathlib.Path(name) / "trace.csv"
            dense_trace("peg-in-a-hole", trace)
            said = run(sys.executable, HERE.parent / "examples/press.py", trace).decode()
        self.assertRegex(said, r"600 rows, most force [1-9][0-9.]* N")


class Steps(unittest.TestCase):
    def test_the_example_of_the_readme_runs_as_written(self):
        text = (HERE.parent / "README.md").read_text()
        example = re.search(r"```python\n(.*?)```", text, re.S).group(1)
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(example, {})
        force, height = re.match(r"([0-9.]+) N, the sphere is at ([0-9.]+) mm", said.getvalue()).groups()
        self.assertGreater(float(force), 1)
        self.assertGreater(float(height), 19.9)  # its radius is 20 mm

    def test_a_contact_has_a_point_and_a_normal(self):
        sim = taut.Simulation("sphere-on-plane")
        device = sim.start
        device[2] = 0.015
        self.assertGreater(sim.update(device).contacts, 0)
        rows = sim.constraints()
        self.assertEqual(rows.shape[1], 7)
        self.assertAlmostEqual(rows[0, 5], 1)
        first = sim.force(0.0, device).wrench
        sim.reset()
        np.testing.assert_array_equal(sim.god_object, sim.start)
        sim.update(list(device))  # lists are taken as well
        np.testing.assert_array_equal(sim.force(0.0, device).wrench, first)

    def test_obstacles_are_moved(self):
        sim = taut.Simulation("sphere-on-plane")
        target = sim.obstacle_pose(0)
        target[2] -= 0.01
        sim.move_obstacle(0, target)
        sim.update(sim.start)
        np.testing.assert_array_equal(sim.obstacle_pose(0), target)

    def test_bad_input_is_an_exception_with_a_text(self):
        sim = taut.Simulation("sphere-on-plane")
        nan = sim.start
        nan[0] = np.nan
        sim.force(1.0, sim.start)
        cases = [
            (lambda: sim.update(nan), "finite"),
            (lambda: sim.update(sim.start[:3]), "7 numbers"),
            (lambda: sim.update([sim.start]), r"7 numbers.* \[1, 7\]"),
            (lambda: sim.force(2.0, sim.start[:, np.newaxis]), r"7 numbers.* \[7, 1\]"),
            (lambda: sim.move_obstacle(0, 1.0), r"7 numbers.* \[\]"),
            (lambda: sim.update([0, 0, 0, 2, 0, 0, 0]), "norm 2"),
            (lambda: sim.force(0.5, sim.start), "never run back"),
            (lambda: sim.force(np.nan, sim.start), "the time is NaN"),
            (lambda: sim.obstacle_pose(9), "no obstacle 9"),
            (lambda: sim.move_obstacle(9, sim.start), "no obstacle 9"),
            (lambda: sim.move_obstacle(-1, sim.start), "no obstacle -1; the scene has 1"),
            (lambda: sim.obstacle_pose(-1), "no obstacle -1"),
            (lambda: sim.obstacle_pose(1 << 70), f"no obstacle {1 << 70}"),
            (lambda: taut.Simulation("nowhere.toml"), "nowhere.toml"),
            (lambda: taut.Simulation("sphere-on-plane", ["coupling.k_s=-1"]), "k_s"),
            (lambda: taut.read_trace("nowhere.csv"), "nowhere.csv: cannot be opened"),
        ]
        for call, text in cases:
            with self.subTest(text), self.assertRaisesRegex(taut.TautError, text):
                call()
        self.assertRaises((TypeError, ValueError), lambda: sim.update("here"))
        self.assertRaises(TypeError, lambda: sim.obstacle_pose("floor"))

    def test_files_are_checked_as_by_the_program(self):
        for name in ("nowhere.ply", SCENES / "peg-in-a-hole.toml"):
            done = subprocess.run([os.environ["TAUT_PROGRAM"], "check", str(name)], capture_output=True, text=True)
            self.assertIn(str(taut.check(name)), done.stdout + done.stderr)

    def test_the_figures_of_a_mesh_are_of_the_kinds_that_the_stub_names(self):
        with tempfile.TemporaryDirectory() as name:
            mesh = pathlib.Path(name) / "corner.obj"  # a tetrahedron, m
            mesh.write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.2 0\nv 0 0 0.3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
            report = taut.check(mesh)
        self.assertEqual(report.size, (0.1, 0.2, 0.3))
        self.assertEqual((report.triangles, report.watertight), (4, True))
        self.assertAlmostEqual(report.volume, 0.001)
        self.assertIsNone(taut.check("nowhere.ply").size)


class Threads(unittest.TestCase):
    def test_threads_with_scenes_of_their_own_and_with_a_shared_one_agree_with_one(self):
        def press(sim, heights):
            return [sim.update([0, 0, z, 1, 0, 0, 0]).gap_min for z in heights]

        heights = np.linspace(0.05, 0.01, 300)
        expected = press(taut.Simulation("sphere-on-plane"), heights)
        answers, shared = {}, taut.Simulation("sphere-on-plane")
        threads = [
            threading.Thread(target=lambda n=n: answers.update({n: press(taut.Simulation("sphere-on-plane"), heights)}))
            for n in range(3)
        ] + [threading.Thread(target=lambda: press(shared, heights)) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual([answers[n] for n in range(3)], [expected] * 3)
        self.assertGreater(shared.god_object[2], 0.0199)

    def test_the_interpreter_goes_on_during_a_replay(self):
        with tempfile.TemporaryDirectory() as name:
            trace = pathlib.Path(name) / "trace.csv"
            dense_trace("peg-in-a-hole", trace)
            sys.setswitchinterval(60)  # nobody takes the lock away: it must be given
            try:
                thread = threading.Thread(target=taut.replay, args=("peg-in-a-hole", trace))
                thread.start()
                turns = 0
                while thread.is_alive():
                    turns += 1
                    thread.join(0.0001)
                self.assertGreater(turns, 3)
            finally:
                sys.setswitchinterval(0.005)


if __name__ == "__main__":
    unittest.main(verbosity=2)
