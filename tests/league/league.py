"""The league of engines: truth, tuning on training hands, the judged hands, a CSV file.

    scripts/league                          everything; answers and runs are kept in target/league and not done twice
    scripts/league --scenes "peg; box" --engines "taut; MuJoCo"

Rows that are not made anew stay. Picture and table are drawn from the file by scripts/laboratory.
"""

import argparse
import csv
import hashlib
import importlib.metadata
import json
import pathlib
import sys
import time

import numpy as np

import engines
import measures
import oracle
import scenes

ROOT = pathlib.Path(__file__).parents[2]
WORK = ROOT / "target/league"
CSV = ROOT / "docs/pictures/league.csv"
REPEATS = 3
LONG = 4.0  # s: a run that takes longer is not repeated
PACKAGES = {"MuJoCo": "mujoco", "MuJoCo, SDF": "mujoco", "PyBullet": "pybullet", "Drake, point": "drake", "Drake, hydroelastic": "drake",
            "coal and penalty": "coal", "taut": "taut"}


def truth(scene, which, finer=1):
    """The oracle's poses, kept under the name of what they follow from."""
    sources = (pathlib.Path(__file__).parent / "oracle.py").read_bytes()
    what = hashlib.sha256(sources + repr((scene.trace(which).tobytes(), scene.radius, finer)).encode()
                          + b"".join(piece.tobytes() for part in (scene.held, scene.obstacle) for piece in part.pieces)).hexdigest()[:16]
    path = WORK / "truth" / f"{what}.npz"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        poses, worst, unsettled = oracle.answers(scene, which, finer, 0.1 / finer)
        np.savez(path, poses=poses, worst=worst, unsettled=unsettled)
        print(f"truth of {scene.name}, {which}, {finer} a ms: overlap at most {worst * 1e9:.1f} nm, {unsettled} unsettled", flush=True)
    stored = np.load(path)
    return stored["poses"], float(stored["worst"]), int(stored["unsettled"])


def tuned(engine, scene, folder):
    """The settings with the least J on the training hand, at the 95th percentile; None where none runs."""
    trace = scene.trace("train")
    right = oracle.wrench(scene, trace, truth(scene, "train")[0])
    best, reason = (np.inf, None), "no settings"
    for settings in engine.GRIDS:
        try:
            _, forces, _ = engines.run(engine, scene, "train", folder, settings)
            best = min(best, (measures.percentile(measures.felt(scene, forces, right), 95), settings), key=lambda pair: pair[0])
        except Exception as error:
            reason = f"{type(error).__name__}: {str(error).splitlines()[0][:120]}"
    return best[1], reason


def compete(engine, scene):
    """One row of the CSV file."""
    folder = WORK / "runs" / engine.__name__ / scene.name.replace(" ", "-").replace(",", "")
    row = {"engine": engine.label, "version": importlib.metadata.version(PACKAGES[engine.label]), "scene": scene.name}
    settings, reason = tuned(engine, scene, folder) if len(engine.GRIDS) > 1 else (engine.GRIDS[0], "")
    if settings is None:
        return row | {"fault": reason}
    row["settings"] = " ".join(f"{k}={v}" for k, v in settings.items()) or "default"
    trace, (answer, _, _) = scene.trace("judge"), truth(scene, "judge")
    right, times = oracle.wrench(scene, trace, answer), []
    try:
        began = time.monotonic()
        for repeat in range(REPEATS):
            if repeat and time.monotonic() - began > LONG:
                break
            poses, forces, spent = engines.run(engine, scene, "judge", folder, settings)
            times.append(spent)
    except Exception as error:
        return row | {"fault": f"{type(error).__name__}: {str(error).splitlines()[0][:120]}"}
    np.savez(folder / "judge.npz", trace=trace, poses=poses, forces=forces, answer=answer, right=right)
    spent = 1e6 * np.median(times, axis=0)
    row |= measures.judge(scene, trace, answer, poses, forces, right)
    return row | {"us_p50": np.median(spent), "us_p99": np.percentile(spent, 99), "us_max": spent.max(), "real_time": 1e3 / spent.mean()}


def halved(scene):
    """How far the oracle is from itself at half the step and half the trust region."""
    trace, (once, worst, unsettled), (twice, _, _) = scene.trace("judge"), truth(scene, "judge"), truth(scene, "judge", 2)
    a, b = oracle.wrench(scene, trace, once), oracle.wrench(scene, trace, twice)
    force = np.linalg.norm(b[:, :3], axis=1)
    change = np.linalg.norm((a - b)[:, :3], axis=1)[force > 0.1] / force[force > 0.1]
    row = {"engine": "oracle, half steps", "version": "", "scene": scene.name, "settings": f"overlap {worst * 1e9:.1f} nm, {unsettled} unsettled"}
    row |= measures.judge(scene, trace, twice, once, a, b)
    return row | {"change_percent_p99": 100 * measures.percentile(change, 99)}


def wired(engine):
    """The force of a box pressed 5 mm into a plane, and how far it is from the hand's turn in free space."""
    scene = scenes.wiring()
    row = {"engine": engine.label, "version": importlib.metadata.version(PACKAGES[engine.label]), "scene": "wiring"}
    settings = engine.GRIDS[-1]
    poses, forces, _ = engines.run(engine, scene, "judge", WORK / "runs" / engine.__name__ / "wiring", settings)
    pressed, turned = forces[950], poses[-1]
    from scipy.spatial.transform import Rotation

    goal = Rotation.from_quat(scene.trace("judge")[-1, 4:])
    left = np.degrees((goal * Rotation.from_quat(turned[3:]).inv()).magnitude())
    row["settings"] = f"5 N: {pressed[2]:.3f} N up, {np.linalg.norm(pressed[:2]):.4f} N aside; turn left {left:.4f} degrees, force {np.linalg.norm(forces[-1, :3]):.4f} N"
    return row


def kept(engine, scene):
    return WORK / "rows" / f"{engine}-{scene}.json"


def keep(row):
    """A row as a file of its own, so that scenes can be run side by side."""
    path = kept(row["engine"], row["scene"])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({name: value.item() if isinstance(value, np.generic) else value for name, value in row.items()}))
    print(row["engine"], "|", row["scene"], "|", row.get("settings"), "| J", row.get("j_p95"), "us", row.get("us_p50"), row.get("fault", ""), flush=True)


def write():
    """The CSV file: its rows, those made since in place of theirs."""
    with CSV.open(newline="") as file:
        rows = {(row["engine"], row["scene"]): row for row in csv.DictReader(file)}
    for path in (WORK / "rows").glob("*.json"):
        row = json.loads(path.read_text())
        rows[row["engine"], row["scene"]] = row
    order = [scene.name for scene in [scenes.wiring(), *scenes.all_scenes()]]
    names = ["oracle, half steps", *[engine.label for engine in engines.ALL]]
    rows = sorted((row for row in rows.values() if row["scene"] in order), key=lambda row: (order.index(row["scene"]), names.index(row["engine"])))
    columns = ["engine", "version", "scene", "settings"]
    for row in rows:
        columns += [name for name in row if name not in columns and name != "fault"]
    columns.append("fault")
    with CSV.open("w", newline="") as file:
        table = csv.DictWriter(file, columns, lineterminator="\n")
        table.writeheader()
        for row in rows:
            table.writerow({k: ("" if v != v else f"{v:.4g}") if isinstance(v, float) else v for k, v in row.items()})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default="", help="names, or parts of names, with ; between")
    parser.add_argument("--engines", default="", help="likewise")
    parser.add_argument("--truth", action="store_true", help="the oracle's answers alone")
    parser.add_argument("--again", action="store_true", help="rows that are there already, too")
    arguments = parser.parse_args()
    wanted = lambda name, parts: not parts or any(part.strip() in name for part in parts.split(";"))
    chosen = [scene for scene in scenes.all_scenes() if wanted(scene.name, arguments.scenes)]
    players = [engine for engine in engines.ALL if wanted(engine.label, arguments.engines)]
    for scene in chosen:
        for which, finer in (("train", 1), ("judge", 1), ("judge", 2)):
            truth(scene, which, finer)
        if arguments.again or not kept("oracle, half steps", scene.name).exists():
            keep(halved(scene))
    if arguments.truth:
        return
    for player in players:
        for scene in [scenes.wiring(), *chosen]:
            if arguments.again or not kept(player.label, scene.name).exists():
                keep(wired(player) if scene.name == "wiring" else compete(player, scene))
    write()


if __name__ == "__main__":
    sys.path.insert(0, str(pathlib.Path(__file__).parent))
    main()
