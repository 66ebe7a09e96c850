"""The chart of the league, and its table for docs/laboratory.md, from the rows of the CSV file."""

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

COLOURS = ["#c0392b", "#1f5fa8", "#2e8b57", "#8e5ea2", "#5aa7d6", "#b98bc9", "#8c6d31"]
BUDGET, FELT = 0.5, 1.0
MANY_RESTS = ("cylinder in groove", "ball on ball")  # a faceted body may rest on this facet or the next: shown, and not counted


def number(row, name):
    return float(row[name]) if row.get(name) else np.nan


def draw(rows, path):
    plt.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "league", "font.family": "sans-serif", "font.size": 9})
    rows = [row for row in rows if row["scene"] != "wiring" and row["version"]]
    engines, scenes = list(dict.fromkeys(r["engine"] for r in rows)), list(dict.fromkeys(r["scene"] for r in rows))
    order = ["taut"] + sorted(e for e in engines if e != "taut")
    by = {(r["engine"], r["scene"]): r for r in rows}
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 5.6), gridspec_kw={"width_ratios": [1, 1.25]})
    for engine, colour in zip(order, COLOURS):
        own = [r for r in rows if r["engine"] == engine and r["scene"] not in MANY_RESTS]
        x, y = (np.array([number(r, name) for r in own]) for name in ("us_p50", "j_p95"))
        left.scatter(x, y, s=14, color=colour, alpha=0.45, linewidths=0)
        left.scatter(np.nanmedian(x), np.nanmedian(y), s=110, color=colour, edgecolor="black", linewidth=0.8, label=engine, zorder=3)
    left.set(xscale="log", yscale="log", xlabel="CPU time of a millisecond of the hand, median, us", ylabel="error felt: J, 95th percentile")
    left.axhline(FELT, color="black", linewidth=0.8)
    left.axvline(1000, color="black", linewidth=0.8, linestyle=":")
    left.text(left.get_xlim()[0] * 1.1, FELT * 1.08, "J = 1: just noticeable")
    left.text(960, left.get_ylim()[1] * 0.8, "real time", rotation=90, ha="right", va="top")
    left.legend(loc="lower right", fontsize=8, framealpha=0.9)
    left.set_title("Small: one scene. Large: median over the scenes")
    for i, scene in enumerate(scenes):
        for k, engine in enumerate(order):
            row = by.get((engine, scene), {})
            j = number(row, "j_p95")
            colour = "#dddddd" if np.isnan(j) else "#bfe3c3" if j <= BUDGET else "#fbe7a1" if j <= FELT else "#f2b5ab"
            right.add_patch(plt.Rectangle((k, i), 1, 1, facecolor=colour, edgecolor="white"))
            text = "" if not row else "cannot" if np.isnan(j) else f"{j:.2f}" if j < 9.995 else f"{j:.0f}"
            right.text(k + 0.5, i + 0.5, text, ha="center", va="center", fontsize=8.5)
    right.set(xlim=(0, len(order)), ylim=(len(scenes), 0))
    right.set_xticks(np.arange(len(order)) + 0.5, [e.replace(", ", ",\n").replace(" and ", "\nand ") for e in order])
    right.set_yticks(np.arange(len(scenes)) + 0.5, [scene + " *" * (scene in MANY_RESTS) for scene in scenes])
    right.tick_params(length=0)
    right.xaxis.tick_top()
    for side in right.spines.values():
        side.set_visible(False)
    right.set_title("J, 95th percentile: green within the budget of 0.5, red above 1, grey not run; *: several places of rest, not counted", y=-0.08, fontsize=9)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None}, bbox_inches="tight")
    print(table(order, scenes, by))


def table(order, scenes, by):
    head = ["engine", "J", "J of taut in the same scenes", "angle, degrees", "force error, N", "penetration, um", "place, um", "axial force, N", "us, p50", "us, p99", "us, max", "J > 0.5", "J > 1", "cannot", "scenes"]
    scenes = [scene for scene in scenes if scene not in MANY_RESTS]
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    for engine in order:
        cells = [engine]
        for name in ("j_p95", "angle_deg_p95", "force_error_n_p95", "penetration_um_max", "place_um_p95", "axial_n_p95", "us_p50", "us_p99", "us_max"):
            values = np.array([number(by.get((engine, scene), {}), name) for scene in scenes])
            values = values[~np.isnan(values)]
            cells.append(f"{np.median(values):.3g} / {values.max():.3g}" if len(values) else "")
        there = [scene for scene in scenes if by.get((engine, scene), {}).get("j_p95")]
        ours = [number(by.get(("taut", scene), {}), "j_p95") for scene in there]
        cells.insert(2, f"{np.median(ours):.3g} / {max(ours):.3g}" if ours else "")
        j = np.array([number(by.get((engine, scene), {}), "j_p95") for scene in scenes])
        cells += [str((j > BUDGET).sum()), str((j > FELT).sum()), str(sum(bool(by.get((engine, scene), {}).get("fault")) for scene in scenes)), str(sum((engine, scene) in by for scene in scenes))]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)
