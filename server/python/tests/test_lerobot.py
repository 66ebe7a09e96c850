"""`python -m taut.lerobot` on recordings of `taut demo`, read by pyarrow (and pandas, as LeRobot reads tasks). Run by scripts/test-languages."""

import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np
import pandas
import pyarrow.parquet
import taut
import taut.lerobot

FPS = 40


def record(scene, directory):
    demo = [os.environ["TAUT_PROGRAM"], "demo", "--headless", "--no-monitor", "--port", "0", "--duration", "3"]
    done = subprocess.run([*demo, "--scene", scene, "--recording", directory], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def newest(records, time, columns, when):
    """The numbers of the last record at or before `when`, by looking at all."""
    found = None
    for record in records:
        if int(record[time]) <= when:
            found = record
    return [float(record) for record in map(found.get, columns)]


class LeRobot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.place = pathlib.Path(cls.temporary.name)
        cls.sessions = [cls.place / "press", cls.place / "plate"]
        for scene, session in zip(["sphere-on-plane", "moving-plate"], cls.sessions):
            record(scene, session)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_two_sessions_are_two_episodes_with_the_recorded_numbers(self):
        out = self.place / "dataset"
        done = subprocess.run(
            [sys.executable, "-m", "taut.lerobot", *self.sessions, out, "--fps", str(FPS)], capture_output=True, text=True
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        info = json.loads((out / "meta/info.json").read_text())
        self.assertEqual((info["codebase_version"], info["fps"], info["total_episodes"]), ("v3.0", FPS, 2))
        table = pyarrow.parquet.read_table(out / info["data_path"].format(chunk_index=0, file_index=0))
        self.assertEqual(set(table.column_names), set(info["features"]))
        self.assertEqual(table.num_rows, info["total_frames"])
        self.assertEqual(table["index"].to_pylist(), list(range(table.num_rows)))
        self.assertGreater(table.num_rows, 2 * 2 * FPS)
        for key, feature in info["features"].items():
            shape = np.stack(table[key].to_numpy()).shape
            self.assertEqual(shape, (table.num_rows, *feature["shape"]) if feature["shape"] != [1] else (table.num_rows,))

        episodes = pyarrow.parquet.read_table(out / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
        self.assertEqual([episode["tasks"] for episode in episodes], [["sphere-on-plane"], ["moving-plate"]])
        for number, (episode, session) in enumerate(zip(episodes, self.sessions)):
            frames = table.slice(episode["dataset_from_index"], episode["length"]).to_pylist()
            self.assertEqual({frame["episode_index"] for frame in frames}, {number})
            self.assertEqual({frame["task_index"] for frame in frames}, {number})
            haptics, updates = rows(session / "haptics.csv"), rows(session / "updates.csv")
            haptics = [row for row in haptics if row["faulty"] == "0"]
            begin = max(int(haptics[0]["t_ns"]), int(haptics[0]["tick_ns"]), int(updates[0]["published_ns"]))
            for frame in frames[:: len(frames) // 7]:
                self.assertAlmostEqual(frame["timestamp"], frame["frame_index"] / FPS, places=5)
                when = begin + frame["frame_index"] * 10**9 // FPS
                for key, records, time, columns in [
                    ("action", haptics, "t_ns", "x y z qw qx qy qz"),
                    ("observation.wrench", haptics, "tick_ns", "fx fy fz tx ty tz"),
                    ("observation.velocity", haptics, "t_ns", "vx vy vz wx wy wz"),
                    ("observation.state", updates, "published_ns", "sx sy sz sqw sqx sqy sqz"),
                ]:
                    expected = np.array(newest(records, time, columns.split(), when), dtype="float32")
                    np.testing.assert_array_equal(np.array(frame[key], dtype="float32"), expected, key)
        stats = json.loads((out / "meta/stats.json").read_text())
        actions = np.stack(table["action"].to_numpy())
        np.testing.assert_allclose(stats["action"]["mean"], actions.mean(0, dtype="float64"))
        np.testing.assert_allclose(stats["action"]["q50"], np.median(actions, axis=0))
        self.assertEqual(stats["action"]["count"], [table.num_rows])
        tasks = pandas.read_parquet(out / "meta/tasks.parquet")
        self.assertEqual(tasks.index.name, "task")
        self.assertEqual(tasks.loc["moving-plate"].task_index, 1)

    def test_a_force_is_that_of_its_time_also_where_the_device_is_silent(self):
        silent, out = self.place / "silent", self.place / "of-silent"
        shutil.copytree(self.sessions[0], silent)
        haptics = rows(silent / "haptics.csv")
        quarter = len(haptics) // 4
        for row in haptics[quarter : 3 * quarter]:
            row["t_ns"] = haptics[quarter]["t_ns"]
        with open(silent / "haptics.csv", "w", newline="") as file:
            writer = csv.DictWriter(file, haptics[0], lineterminator="\n")
            writer.writeheader()
            writer.writerows(haptics)
        taut.lerobot.export([silent], out, FPS)
        table = pyarrow.parquet.read_table(out / "data/chunk-000/file-000.parquet")
        good = [row for row in haptics if row["faulty"] == "0"]
        updates = rows(silent / "updates.csv")
        begin = max(int(good[0]["t_ns"]), int(good[0]["tick_ns"]), int(updates[0]["published_ns"]))
        differ = 0
        for frame in table.to_pylist():
            when = begin + frame["frame_index"] * 10**9 // FPS
            felt, later = (
                np.array(newest(good, time, "fx fy fz tx ty tz".split(), when), dtype="float32") for time in ("tick_ns", "t_ns")
            )
            np.testing.assert_array_equal(np.array(frame["observation.wrench"], dtype="float32"), felt)
            differ += (felt != later).any()
        self.assertGreater(differ, 0, "the force changes meanwhile")

    def test_half_a_session_is_exported_and_said_not_to_be_whole(self):
        killed = self.place / "killed"
        shutil.copytree(self.sessions[0], killed)
        manifest = json.loads((killed / "recording.json").read_text())
        (killed / "recording.json").write_text(json.dumps(manifest | {"complete": False}))
        text = (killed / "haptics.csv").read_bytes()
        (killed / "haptics.csv").write_bytes(text[: len(text) // 2] + b"7,1")
        said = "\n".join(taut.lerobot.export([killed], self.place / "half", task="press"))
        self.assertRegex(said, "haptics.csv: its last line is cut off")
        self.assertRegex(said, "not whole .the session did not come to its end")
        info = json.loads((self.place / "half/meta/info.json").read_text())
        self.assertLess(info["total_frames"], 2 * 50)
        self.assertGreater(info["total_frames"], 10)

    def test_a_file_that_was_cut_between_two_lines_is_said_to_be(self):
        cut = self.place / "cut"
        shutil.copytree(self.sessions[0], cut)
        lines = (cut / "updates.csv").read_bytes().splitlines(keepends=True)
        (cut / "updates.csv").write_bytes(b"".join(lines[: len(lines) // 2]))
        said = "\n".join(taut.lerobot.export([cut], self.place / "short"))
        self.assertRegex(said, f"updates.csv: ends after {len(lines) // 2 - 1} records, but the session wrote {len(lines) - 1};")
        said = "\n".join(taut.lerobot.export([self.sessions[0]], self.place / "all"))
        self.assertNotIn("ends after", said)

    def test_what_is_written_after_a_file_was_opened_is_not_read(self):
        growing = self.place / "growing"
        shutil.copytree(self.sessions[0], growing)
        opened = pyarrow.memory_map

        def opened_and_grown(path):
            file = opened(path)
            with open(path, "ab") as more:
                more.write(b"7,1\n")
            return file

        with mock.patch("pyarrow.memory_map", opened_and_grown):
            said = "\n".join(taut.lerobot.export([growing], self.place / "grown"))
        self.assertNotRegex(said, "cut off|ends after")

    def test_what_cannot_be_exported_is_said_and_leaves_nothing(self):
        broken = self.place / "broken"
        shutil.copytree(self.sessions[0], broken)
        lines = (broken / "updates.csv").read_text().splitlines()
        lines[5] = lines[5].replace(",", ",x", 1)
        (broken / "updates.csv").write_text("\n".join(lines) + "\n")
        new = self.place / "new"
        for sessions, out, fps, text in [
            ([self.place / "nowhere"], new, 50, "nowhere/recording.json: cannot be read"),
            (self.sessions, self.sessions[0], 50, "is not empty"),
            (self.sessions, new, 0, "from 1 to 1000"),
            ([broken], new, 50, "updates.csv: cannot be read"),
            (self.place.glob("none-*"), new, 50, "there is no session"),
        ]:
            with self.subTest(text), self.assertRaisesRegex(taut.TautError, text):
                taut.lerobot.export(sessions, out, fps)
        self.assertFalse(new.exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
