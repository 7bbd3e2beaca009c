"""Tables of results, from `benchmarks/results/`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from relpos_env.scenarios import SCENARIOS
from tables.ablation import tables
from tables.markdown import markdown

MEASURED = Path(__file__).resolve().parents[1] / "results"
RESULTS = MEASURED / "tracker-results.jsonl"
"""Metrics of the filters, written by `measure_results.py`."""


def second_world() -> str:
    """Return the table of errors in the second world."""
    head = ("", "worlds", "rmse_yaw / shape", "over the bound", "NEES", "`ok`", "`ok` and wrong",
            "`ok` and within its accuracy")  # fmt: skip
    rows = []
    for r in measured("second-world"):
        rows.append([
            r["kind"], f"{r['worlds']}", f"{r['yaw']:.3f} / {r['shape']:.3f}",
            f"{r['yaw_ratio']:.2f} / {r['shape_ratio']:.2f}", f"{r['nees']:.2f}",
            f"{100.0 * r['ok']:.0f} %", f"{100.0 * r['wrong']:.2f} %",
            f"{100.0 * r['within']:.1f} %",
        ])  # fmt: skip
    return markdown(head, rows, right="rest")


def time_to_ok() -> str:
    """Return the table of the times until pairs are ok."""
    head = ("runs of", "an efficient estimator [s]", "`ok` [s]", "within twice", "never `ok`",
            "`ok` with matched noise [s]", "matched: within twice")  # fmt: skip
    rows = []
    for r in measured("time-to-ok"):
        rows.append([
            r["kind"], f"{r['needed_s']:.1f}", f"{r['ok_s']:.1f}",
            f"{100.0 * r['within_twice']:.0f} %", f"{r['never']}/{r['sufficient']}",
            f"{r['matched_s']:.1f}", f"{100.0 * r['matched_within_twice']:.0f} %",
        ])  # fmt: skip
    return markdown(head, rows, right="rest")


def own_trackers() -> str:
    """Return the table of one tracker for the group and of a tracker on each car."""
    head = ("loss", "trackers", "error [m]", "ratio", "`ok`", "`ok` and wrong by 0.5 m",
            "disagreement [m]", "ranges of a pair [Hz]")  # fmt: skip
    rows, of_group = [], 1.0
    for r in measured("own-trackers"):
        of_group = r["error"] if r["trackers"] == "group" else of_group
        is_own = r["trackers"] == "own"
        loss = "as in the scenario" if r["loss"] is None else f"{100.0 * r['loss']:.0f} %"
        rows.append([
            "" if is_own else loss, r["trackers"], f"{r['error']:.3f}",
            f"{r['error'] / of_group:.2f}" if is_own else "", f"{100.0 * r['ok']:.1f} %",
            f"{100.0 * r['wrong']:.2f} %", f"{r['disagreement']:.3f}" if is_own else "",
            f"{r['ranges_hz']:.0f}",
        ])  # fmt: skip
    return markdown(head, rows, right=", ".join(head[2:]))


def policy_results() -> str:
    """Return the table of errors of the shipped policy with distance sensors and of controllers."""
    head = ("room", "cars", "driver", "error", "95 %", "place", "tracking", "collisions/min",
            "in contact", "in formation", "ratio to the best controller")  # fmt: skip
    rows, before = [], ""
    for line in (MEASURED / "policy-results.jsonl").read_text().splitlines():
        r = json.loads(line)
        low, high = r["ci95"]
        ratio = "{:.2f} to {:.2f}".format(*r["ratio_ci95"])
        is_new, before = r["scenario"] != before, r["scenario"]
        drawn = SCENARIOS[r["scenario"]].randomisation.n_cars
        rows.append([
            f"`{r['scenario']}`" if is_new else "",
            "{} to {}".format(*drawn) if drawn else str(r["cars"]),
            r["policy"], f"{r['formation_error']:.3f}", f"{low:.3f} to {high:.3f}",
            f"{r['place_error']:.2f}", f"{r['tracking_error']:.3f}",
            f"{r['collisions_per_min']:.2f}", f"{100.0 * r['contact_time']:.2f} %",
            f"{100.0 * r['time_in_formation']:.1f} %", f"{r['ratio']:.2f} ({ratio})",
        ])  # fmt: skip
    return markdown(head, rows, right=", ".join(head[3:]))


def observe_results() -> str:
    """Return the table of tracking errors with and without weaving."""
    head = ("task, scenario", "cars", "controller", "tracking error [m]", "95 %", "ratio",
            "formation error [m]", "95 %", "collisions/min", "in contact")  # fmt: skip
    rows, plain = [], 1.0
    for r in measured("observe-results"):
        is_first = r["policy"] == "consensus"
        plain = r["tracking_error"] if is_first else plain
        spans = ["{:.3f} to {:.3f}".format(*r[k]) for k in ("tracking_error_ci95", "ci95")]
        rows.append([
            f"`{r['task']}`, `{r['scenario']}`" if is_first else "", str(r["cars"]), r["policy"],
            f"{r['tracking_error']:.3f}", spans[0], f"{r['tracking_error'] / plain:.2f}",
            f"{r['formation_error']:.3f}", spans[1], f"{r['collisions_per_min']:.1f}",
            f"{100.0 * r['contact_time']:.1f} %",
        ])  # fmt: skip
    return markdown(head, rows, right=", ".join(head[3:]))


def results(is_recording: bool) -> list[dict[str, Any]]:
    """Return the result lines of recordings or of simulated rooms."""
    lines = [json.loads(line) for line in RESULTS.read_text().splitlines()]
    return [line for line in lines if ("from" in line) == is_recording]


def room_results() -> str:
    """Return the table of errors of all filters in the rooms of the paper."""
    head = ("room", "filter", "the paper's number (hardware)", "rmse", "rmse_yaw", "rmse_shape",
            "bound yaw / shape", "ratio yaw / shape", "lost", "`ok`", "`ok` and wrong",
            "NEES")  # fmt: skip
    rows, before = [], ""
    for r in results(is_recording=False):
        bold = "**" if r["filter"] == "joint" else ""
        bounds = r["bound_yaw"], r["bound_shape"]
        ratios = (r[f"rmse_{name}"] / r[f"bound_{name}"] for name in ("yaw", "shape"))
        rows.append([
            r["case"] if r["case"] != before else "",
            f"{bold}{r['filter']}{bold}",
            "-" if r["paper"] is None else f"{r['paper']:.3f}",
            f"{r['rmse']:.3f}", f"{r['rmse_yaw']:.3f}", f"{bold}{r['rmse_shape']:.3f}{bold}",
            " / ".join(f"{x:.3f}" for x in bounds), " / ".join(f"{x:.2f}" for x in ratios),
            f"{r['lost_runs']}/{r['seeds']}", f"{100.0 * r['ok_share']:.0f} %",
            f"{100.0 * r['integrity_share']:.2f} %", f"{r['nees']:.1f}",
        ])  # fmt: skip
        before = r["case"]
    return markdown(head, rows, right=", ".join(head[2:]))


def recording_results() -> str:
    """Return the table of errors on recordings and of an efficient estimator."""
    found: dict[tuple[str, float], dict[str, str]] = {}
    for r in results(is_recording=True):
        errors = f"{r['rmse']:.2f} / {r['rmse_yaw']:.3f} / {r['rmse_shape']:.3f}"
        found.setdefault((r["case"], r["from"]), {})[r["filter"]] = errors
    names = ("joint", "efficient", "ekf-mds", "ekf")
    rows = [
        [f"{case}, from {first:g} s on", *(of[name] for name in names)]
        for (case, first), of in found.items()
    ]
    return markdown(("recording", *names), rows)


def mds_results() -> str:
    """Return the table of errors of `joint` and of MDS of each instant."""
    rows = []
    for line in measured("mds-results"):
        errors = ["-" if line[k] is None else f"{line[k]:.2f}" for k in ("joint", "mds")]
        rows.append([line["case"], str(line["nodes"]), *errors, str(line["instants"])])
    head = ("recording", "nodes", "joint [m]", "MDS [m]", "instants with all pairs")
    return markdown(head, rows, right="rest")


def tracker_cost() -> str:
    """Return the table of the times of `joint` and of its peers on the same measurements."""
    loops = {r["case"]: r["value"] for r in measured("tracker-cost-loops")}
    times: dict[str, dict[str, float]] = {}
    for r in measured("tracker-cost"):
        if r["case"].startswith("joint"):
            peers = times.setdefault(r["case"], {"joint": r["value"]})
            peers[r["peer"].split()[0]] = r["peer_value"]
    rows = []
    for case, of in times.items():
        gtsam = f"{of['GTSAM']:.0f}" if "GTSAM" in of else ""
        rows.append([
            case.removeprefix("joint, "), f"{of['joint']:.1f}",
            f"{loops[case] / of['joint']:.1f}", f"{of['filterpy']:.0f}", gtsam,
        ])  # fmt: skip
    head = ("a step of", "joint [us]", "plain loops over SIMD", "filterpy [us]", "GTSAM [us]")
    return markdown(head, rows, right="rest")


def measured(name: str) -> list[dict[str, Any]]:
    """Return the rows of a file of results."""
    lines = (MEASURED / f"{name}.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def ablation() -> str:
    """Return the tables of the worth of each mechanism of the joint filter."""
    return tables((MEASURED / "ablation.jsonl").read_text().splitlines()) + "\n"
