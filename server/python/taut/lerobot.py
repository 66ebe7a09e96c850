"""Recordings of sessions as a LeRobot dataset, format v3.0: python -m taut.lerobot SESSION... OUT. Needs pyarrow (pip install pyarrow).

Each session is an episode. At each frame stands the newest record that there was: nothing is interpolated.
"""

import argparse
import json
import os
import pathlib
import sys
from collections.abc import Iterable

import numpy as np

from ._taut import TautError

try:
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet
except ImportError as error:
    lacking = "taut.lerobot needs pyarrow: pip install pyarrow"
    if __name__ == "__main__":
        sys.exit(lacking)
    raise TautError(lacking) from error

POSE = ["x", "y", "z", "qw", "qx", "qy", "qz"]
FEATURES = {
    # Name of the feature: file, the column with the time at which it was so, its columns, and what they are called in the dataset.
    "observation.state": ("updates", "published_ns", ["sx", "sy", "sz", "sqw", "sqx", "sqy", "sqz"], POSE),
    "observation.velocity": ("haptics", "t_ns", ["vx", "vy", "vz", "wx", "wy", "wz"], None),
    "observation.wrench": ("haptics", "tick_ns", ["fx", "fy", "fz", "tx", "ty", "tz"], None),
    "action": ("haptics", "t_ns", POSE, None),
}
TIMES = {"haptics": ["t_ns", "tick_ns"], "updates": ["published_ns"]}
"""Of each file: when the device was there, which is one time for all ticks that read one sample, and the tick."""
COUNTERS = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64", "task_index": "int64"}
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
PATTERN = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
FILE = PATTERN.format(chunk_index=0, file_index=0)
FORMAT = 1
"""Of recordings."""
MOST_FRAMES = 10_000_000
"""Of a dataset: more than two days at the usual 50 a second."""


def export(
    sessions: Iterable[str | os.PathLike[str]], out: str | os.PathLike[str], fps: int = 50, task: str | None = None
) -> list[str]:
    """Writes the dataset into the new directory `out`; a sentence for each thing worth knowing. `task` is what the hand did (default: the scene's name)."""
    out = pathlib.Path(out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise TautError(f"{out}: is there already and is not empty; name a new directory for the dataset")
    if not 1 <= fps <= 1000 or fps != int(fps):
        raise TautError(f"{fps} frames a second: give a whole number from 1 to 1000")
    tables, tasks, episodes, said, begin = [], {}, [], [], 0
    for number, session in enumerate(map(pathlib.Path, sessions)):
        manifest = _manifest(session)
        did = task or manifest["scene"]
        columns, notes = _frames(session, int(fps), manifest["records"])
        said += notes + ([] if manifest["complete"] else [f"{session}: not whole ({manifest['reason'] or 'the session did not come to its end'})"])
        count = len(columns["action"])
        if begin + count > MOST_FRAMES:
            raise TautError(f"{session}: with it the dataset has more than {MOST_FRAMES} frames; export fewer sessions, or fewer frames a second")
        frames = np.arange(count)
        columns["timestamp"] = (frames / fps).astype("float32")
        columns |= {"frame_index": frames, "episode_index": np.full(count, number), "index": begin + frames}
        columns["task_index"] = np.full(count, tasks.setdefault(did, len(tasks)))
        tables.append(columns)
        place = {"data/chunk_index": 0, "data/file_index": 0, "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        span = {"dataset_from_index": begin, "dataset_to_index": begin + count}
        stats = {f"stats/{key}/{what}": value for key, each in _stats(columns).items() for what, value in each.items()}
        episodes.append({"episode_index": number, "tasks": [did], "length": count} | place | span | stats)
        begin += count
    if not episodes:
        raise TautError(f"{out}: there is no session to export; name the directories of recordings")
    _write(out, tables, tasks, episodes, int(fps))
    said.append(f"{out}: {len(episodes)} episodes, {begin} frames at {fps} a second")
    return said


def _manifest(session):
    path = session / "recording.json"
    try:
        manifest = json.loads(path.read_text())
        if manifest["format"] != FORMAT:
            raise TautError(f"{path}: has format {manifest['format']}, and this wheel reads format {FORMAT}; use that of the program that wrote it")
        written = manifest.get("records") or {}  # none until the end of a session, and in older recordings
        return {key: manifest[key] for key in ("scene", "complete", "reason")} | {"records": {name: int(written[name]) for name in TIMES if name in written}}
    except OSError as error:
        raise TautError(f"{path}: cannot be read ({error.strerror}); name the directory of a recording") from error
    except TautError:
        raise
    except (ValueError, KeyError, TypeError) as error:
        raise TautError(f"{path}: is no manifest of a recording ({error})") from error


def _table(session, name):
    """Times (ns) and the columns of a file, by name. A last line that was cut off is none."""
    path = session / f"{name}.csv"
    wanted = {column: pa.float64() for file, _, columns, _ in FEATURES.values() if file == name for column in columns}
    wanted |= {time: pa.int64() for time in TIMES[name]} | ({"faulty": pa.uint8()} if name == "haptics" else {})
    try:
        text = pa.memory_map(str(path)).read_buffer()
        end = _whole_lines(text)
        if b"tick_ns" not in text.slice(0, min(end, 4096)).to_pybytes().split(b"\n")[0]:
            wanted.pop("tick_ns", None)  # recordings of before have no time of ticks
        options = pa.csv.ConvertOptions(column_types=wanted, include_columns=list(wanted))
        table = pa.csv.read_csv(pa.BufferReader(text.slice(0, end)), convert_options=options)
        columns = {column: table[column].to_numpy() for column in wanted}
    except (OSError, KeyError, pa.ArrowException) as error:
        raise TautError(f"{path}: cannot be read ({error}); a file that is damaged elsewhere than at its end is exported by `taut export`") from error
    if not all(np.isfinite(values).all() for values in columns.values()):
        raise TautError(f"{path}: has numbers that are not finite")
    if name == "haptics":
        columns.setdefault("tick_ns", columns["t_ns"])
    if any(len(columns[time]) == 0 or (np.diff(columns[time]) < 0).any() for time in TIMES[name]):
        raise TautError(f"{path}: has no records, or times that run back")
    return columns, text.size > end


def _whole_lines(text):
    """Bytes up to the end of the last line that has one. Of what was mapped: a file that is still written to is longer by now."""
    end = text.size
    while end:
        begin = max(0, end - 4096)
        if (found := text.slice(begin, end - begin).to_pybytes().rfind(b"\n")) >= 0:
            return begin + found + 1
        end = begin
    return 0


def _frames(session, fps, written):
    """The features at each frame, and what is to be said of them; `written` are the records of each file at the end of the session, where it says so."""
    tables, said = {}, []
    for name in TIMES:
        tables[name], cut_off = _table(session, name)
        said += [f"{session / name}.csv: its last line is cut off, and was left out"] if cut_off else []
        found = len(tables[name][TIMES[name][0]]) + cut_off
        if found != written.get(name, found):
            said.append(f"{session / name}.csv: ends after {found} records, but the session wrote {written[name]}; what is missing was left out")
    good = tables["haptics"].pop("faulty") == 0
    if not good.all():
        said.append(f"{session}: {np.count_nonzero(~good)} ticks had no good pose, and were left out")
        tables["haptics"] = {column: values[good] for column, values in tables["haptics"].items()}
    times = {time: tables[name][time] for name in TIMES for time in TIMES[name]}
    if not len(times["t_ns"]):
        raise TautError(f"{session}: no tick had a good pose")
    begin = max(time[0] for time in times.values())
    span = min(time[-1] for time in times.values()) - begin
    if span < 0:
        raise TautError(f"{session}: device and god-object have no time in common")
    count = int(span * fps // 1_000_000_000) + 1
    if count > MOST_FRAMES:
        raise TautError(f"{session}: {count} frames are more than {MOST_FRAMES}; the times are damaged, or take fewer frames a second")
    frames = begin + np.arange(count) * 1_000_000_000 // fps
    newest = {name: np.searchsorted(time, frames, side="right") - 1 for name, time in times.items()}
    old = sum(frames - times["t_ns"][newest["t_ns"]] > 1_000_000_000 // fps)
    if old:
        said.append(f"{session}: at {old} frames the device's newest sample is older than a frame")
    features = {
        key: np.stack([tables[name][column][newest[time]] for column in columns], axis=1).astype("float32")
        for key, (name, time, columns, _) in FEATURES.items()
    }
    return features, said


def _stats(columns):
    """Of each feature, per number."""
    stats = {}
    for key, values in columns.items():
        rows = np.asarray(values, dtype="float64").reshape(len(values), -1)
        each = {"min": rows.min(0), "max": rows.max(0), "mean": rows.mean(0), "std": rows.std(0), "count": [len(rows)]}
        each |= {name: np.quantile(rows, part, axis=0) for name, part in QUANTILES.items()}
        stats[key] = {name: [*map(int if name == "count" else float, value)] for name, value in each.items()}
    return stats


def _write(out, tables, tasks, episodes, fps):
    vectors = {
        key: {"dtype": "float32", "shape": [len(columns)], "names": names or columns} for key, (_, _, columns, names) in FEATURES.items()
    }
    features = vectors | {key: {"dtype": dtype, "shape": [1], "names": None} for key, dtype in COUNTERS.items()}
    (out / "data/chunk-000").mkdir(parents=True, exist_ok=True)
    (out / "meta/episodes/chunk-000").mkdir(parents=True)
    schema = pa.schema(
        [(key, pa.list_(pa.float32(), feature["shape"][0])) for key, feature in vectors.items()]
        + [(key, getattr(pa, dtype)()) for key, dtype in COUNTERS.items()]
    )
    with pa.parquet.ParquetWriter(out / "data" / FILE, schema) as writer:
        for columns in tables:  # an episode is a row group
            arrays = [
                pa.FixedSizeListArray.from_arrays(pa.array(columns[key].ravel()), columns[key].shape[1])
                if key in vectors
                else pa.array(columns[key], getattr(pa, COUNTERS[key])())
                for key in schema.names
            ]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema), row_group_size=max(1, len(columns["index"])))
    pa.parquet.write_table(pa.Table.from_pylist(episodes), out / "meta/episodes" / FILE)
    pa.parquet.write_table(_task_table(tasks), out / "meta/tasks.parquet")
    everything = {key: np.concatenate([columns[key] for columns in tables]) for key in features}
    (out / "meta/stats.json").write_text(json.dumps(_stats(everything), indent=4))
    info = {
        "codebase_version": "v3.0",
        "robot_type": "taut",
        "total_episodes": len(episodes),
        "total_frames": len(everything["index"]),
        "total_tasks": len(tasks),
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": f"data/{PATTERN}",
        "video_path": None,
        "features": features,
    }
    # Last: a dataset without it is none.
    (out / "meta/info.json").write_text(json.dumps(info, indent=4))


def _task_table(tasks):
    """`task_index` by task: LeRobot reads it by pandas, to which the schema says that the tasks are the index."""
    table = pa.table({"task_index": pa.array(tasks.values(), pa.int64()), "task": pa.array(tasks, pa.string())})
    types = {"task_index": ("int64", "int64"), "task": ("unicode", "object")}
    pandas = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            {"name": name, "field_name": name, "pandas_type": pandas_type, "numpy_type": numpy_type, "metadata": None}
            for name, (pandas_type, numpy_type) in types.items()
        ],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": None,
    }
    return table.replace_schema_metadata({"pandas": json.dumps(pandas)})


def main():
    parser = argparse.ArgumentParser(prog="python -m taut.lerobot", description="Recordings of sessions as a LeRobot dataset, format v3.0; each is an episode.")
    parser.add_argument("sessions", metavar="SESSION", nargs="+", help="directories that `taut serve --recording` or `taut demo --recording` wrote")
    parser.add_argument("out", metavar="OUT", help="the new directory of the dataset")
    parser.add_argument("--fps", type=int, default=50, help="frames a second (default: 50)")
    parser.add_argument("--task", help="what the hand did (default: the name of the scene)")
    arguments = parser.parse_args()
    try:
        print("\n".join(export(arguments.sessions, arguments.out, arguments.fps, arguments.task)))
    except TautError as error:
        sys.exit(f"taut.lerobot: {error}")
    except OSError as error:
        sys.exit(f"taut.lerobot: {arguments.out}: cannot be written ({error}); check the path, its permissions and the free space")


if __name__ == "__main__":
    main()
