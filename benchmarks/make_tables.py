"""Generated tables of the documents.

python benchmarks/make_tables.py            regenerates them
python benchmarks/make_tables.py --check    fails if one differs

A table is enclosed by ``<!-- table: NAME -->`` and ``<!-- end of table -->``.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import sys
from collections.abc import Callable, Iterable
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ablation_tables import tables

from agents.settings import leaves
from agents.training.config import TrainConfig
from hardware_bridge.decoders import DECODERS
from hardware_bridge.drivers import DRIVERS
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.rules import RULES
from hardware_bridge.wire.tables import header_table, message_table
from relpos_env import config
from relpos_env.interface.actions import ACTIONS, MAX_SPEED, MAX_STEERING, DiscreteActions
from relpos_env.interface.observations import (
    OBSERVATIONS,
    index_table,
    observation_mode,
    total_size,
)
from relpos_env.scenarios import LEVELS, SCENARIOS, Scenario
from relpos_env.sensors.radio.channel import CHANNELS
from relpos_env.tasks import DEFAULT_WEIGHTS, TASKS
from relpos_env.tasks.needs import DEFAULT_SCENARIO
from tracking.ahrs.params import OrientationParams
from tracking.filters.joint.hypotheses.alignment import TRANSITIONS, Alignment
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.supervision.faults import CATALOGUE, Fault
from tracking.findings import KINDS

ROOT = Path(__file__).resolve().parents[1]
DOCS, MEASURED = ROOT / "docs", ROOT / "benchmarks" / "results"
CARS = 3
"""[-] Cars of the observations whose indices are shown."""
RESULTS = MEASURED / "tracker-results.jsonl"
"""Metrics of the filters, written by `measure_results.py`."""
BLOCK = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end of table -->)", re.DOTALL)


def markdown(head: Iterable[str], rows: Iterable[Iterable[str]], right: str = "") -> str:
    """Return a Markdown table; `right` names the right-aligned columns."""
    head = list(head)
    rule = ["--:" if name in right.split(", ") else "---" for name in head]
    lines = ["| " + " | ".join(cells) + " |" for cells in (head, *rows)]
    lines.insert(1, "|" + "|".join(rule) + "|")
    return "\n".join(lines) + "\n"


def in_others(at_two: int, at_three: int) -> str:
    """Return a size linear in the number of cars n as text, from those for two and three cars."""
    slope = at_three - at_two
    rest = at_two - slope
    if slope == 0:
        return str(rest)
    share = "n - 1" if slope == 1 else f"{slope} (n - 1)"
    return f"{share} + {rest}" if rest else share


def sizes() -> str:
    """Return the table of the observation sizes of all modes."""
    rows = []
    for name in OBSERVATIONS:
        two, three = observation_mode(name, 2), observation_mode(name, CARS)
        n = total_size(three.fields)
        size = in_others(total_size(two.fields), n)
        rows.append([f"`{name}`", size, str(n), "the truth" if two.needs_truth else "the tracker"])
    rows[[r[0] for r in rows].index("`ranges`")][3] = "the radio; the heading is the tracker's"
    return markdown(("mode", "size", "three cars", "from"), rows, right="three cars")


def observations(mode: str) -> str:
    """Return the layout of one observation mode for three cars, with sizes for n cars."""
    small = observation_mode(mode, 2).fields
    large = observation_mode(mode, CARS).fields
    rows = []
    for few, many, row in zip(small, large, index_table(large), strict=True):
        last = f" to {row['last']}" if row["last"] > row["first"] else ""
        size = in_others(few.size, many.size)
        limits = f"{row['low']:g} to {row['high']:g}"
        name = f"`{row['name']}`"
        rows.append([f"{row['first']}{last}", name, size, row["unit"], limits, row["meaning"]])
    return markdown(("index", "field", "size", "unit", "limits", "meaning"), rows)


def continuous() -> str:
    """Return the table of the continuous action."""
    return markdown(
        ("index", "values", "meaning"),
        [
            ["0", "-1 to 1", f"commanded forward speed, share of {MAX_SPEED:g} m/s"],
            ["1", "-1 to 1", f"commanded steering angle, share of {MAX_STEERING:g} rad; left is +"],
        ],
    )


def discrete() -> str:
    """Return the table of the discrete actions."""
    mode = DiscreteActions()
    assert isinstance(ACTIONS["discrete"](), DiscreteActions)
    head = ["speed \\ steering [rad]", *(f"{angle:+.2f}" for angle in mode.angles)]
    rows, number = [], 0
    for speed in mode.speeds:
        cells = []
        for angle in mode.angles:
            assert mode.decode(number, "") == (speed, angle)
            cells.append(str(number))
            number += 1
        rows.append([f"{speed:g} m/s", *cells])
    return markdown(head, rows, right=", ".join(head[1:]))


def weights() -> str:
    """Return the table of the reward weights of all tasks."""
    terms: list[str] = []
    for task in TASKS:
        terms += [t for t in DEFAULT_WEIGHTS[task] if t not in terms]
    rows = []
    for task in TASKS:
        default = config.configure({"task": task})
        has = default.make_task(1).terms
        cells = []
        for term in terms:
            weight = DEFAULT_WEIGHTS[task].get(term)
            unused = "" if term in has else "*"
            cells.append("" if weight is None else f"{weight:g}{unused}")
        rows.append([f"`{task}`", f"`{DEFAULT_SCENARIO[task]}`", *cells])
    return markdown(("task", "scenario", *terms), rows, right=", ".join(terms))


def arguments() -> str:
    """Return the table of the fields of a configuration."""
    meanings = docstrings(config.FormationConfig)
    rows = []
    for f in fields(config.FormationConfig):
        rows.append([f"`{f.name}`", f"`{default_of(f)}`", meanings[f.name]])
    return markdown(("argument", "default", "meaning"), rows)


def default_of(f: Field[Any]) -> str:
    """Return the default of a field as Python code."""
    if f.default is not MISSING:
        return repr(f.default)
    assert f.default_factory is not MISSING
    value = f.default_factory()
    return repr(value) if isinstance(value, dict) else f"{type(value).__name__}()"


def docstrings(cls: type) -> dict[str, str]:
    """Return the docstrings of the fields of a dataclass or enum, each in one line."""
    (body,) = ast.parse(inspect.getsource(cls)).body
    assert isinstance(body, ast.ClassDef)
    meanings = {}
    for line, below in zip(body.body, body.body[1:], strict=False):
        if not isinstance(line, ast.Assign | ast.AnnAssign) or not isinstance(below, ast.Expr):
            continue
        target = line.target if isinstance(line, ast.AnnAssign) else line.targets[0]
        if isinstance(target, ast.Name) and isinstance(below.value, ast.Constant):
            meanings[target.id] = " ".join(str(below.value.value).split())
    return meanings


def scenarios() -> str:
    """Return the table of the scenarios of the package."""
    rows = []
    for name in SCENARIOS:
        s = SCENARIOS[name]
        room = f"{s.room[0]:g} m x {s.room[1]:g} m"
        boxes = str(len(s.obstacles)) if s.gap is None else f"a wall with a gap of {s.gap.width} m"
        channel = next((k for k, c in CHANNELS.items() if c == s.radio.channel), "its own")
        rows.append([f"`{name}`", room, str(s.n_cars), s.layout, boxes, channel, drawn(s)])
    head = ("scenario", "room", "cars", "start", "obstacles", "radio", "drawn again")
    return markdown(head, rows, right="cars")


def drawn(s: Scenario) -> str:
    """Return the randomisation of a scenario per episode, apart from poses, as text."""
    for k, level in enumerate(LEVELS):
        if s.randomisation == level:
            return f"level {k}" if k else ""
    own = [f.name for f in fields(s.randomisation)]
    least = [
        (sum(getattr(s.randomisation, n) != getattr(level, n) for n in own), k)
        for k, level in enumerate(LEVELS)
    ]
    _, nearest = min(least)
    differ = [n for n in own if getattr(s.randomisation, n) != getattr(LEVELS[nearest], n)]
    changes = ", ".join(f"{n} {getattr(s.randomisation, n)}" for n in differ)
    return f"level {nearest}, {changes}"


def training() -> str:
    """Return the table of the options of a training run."""
    rows = []
    for leaf in leaves(TrainConfig):
        default = ",".join(map(str, leaf.default)) if leaf.many else leaf.default
        shown = f"`{default}`" if default != "" else "none"
        rows.append([f"`{leaf.option}`", shown, leaf.help])
    return markdown(("option", "default", "meaning"), rows)


def driver(name: str) -> str:
    """Return the table of the options of a motor driver."""
    options = DRIVERS[name].options
    meanings = docstrings(options)
    rows = [[f"`{f.name}`", f"`{default_of(f)}`", meanings[f.name]] for f in fields(options)]
    return markdown(("option", "default", "meaning"), rows)


def decoders() -> str:
    """Return the table of the supported device formats."""
    rows = []
    for name, entry in DECODERS.items():
        tells = ", ".join(kind.__name__.removesuffix("Reading").lower() for kind in entry.tells)
        who = "itself" if entry.names_itself else "`node` of the link"
        when = "its clock" if entry.has_time else "on arrival"
        check = "with a key" if entry.keyed else "yes" if entry.checked else "no"
        rows.append([f"`{name}`", entry.device, tells, who, when, str(entry.baud), check])
    head = ("format", "device", "tells", "sender", "time", "baud", "check sum")
    return markdown(head, rows, right="baud")


def safety_rules() -> str:
    """Return the table of the rules of the safety gate, in order of reporting."""
    rows = []
    for rule in RULES:
        does = inspect.getdoc(rule.check) or ""
        rows.append([f"`{rule.name}`", does.partition("\n")[0], rule.effect, rule.meaning])
    return markdown(("rule", "when", "then", "message"), rows)


def safety_limits() -> str:
    """Return the table of the limits of the safety gate."""
    meanings = docstrings(SafetyParams)
    rows = [[f"`{f.name}`", f"`{default_of(f)}`", meanings[f.name]] for f in fields(SafetyParams)]
    return markdown(("limit", "default", "meaning"), rows)


def alignment() -> str:
    """Return the table of the alignment states and their transitions."""
    rows = []
    for state, following in TRANSITIONS.items():
        then = "; ".join(f"{why}: `{after.name}`" for after, why in following.items())
        rows.append([f"`{state.name}`", docstrings(Alignment)[state.name], then])
    return markdown(("state", "what it is", "then"), rows)


def faults() -> str:
    """The catalogue of faults."""
    meaning = docstrings(Fault)
    rows = [
        [f"`{f.name}`", " ".join(meaning[f.name].split()), f"`{r.limit}`", r.decided, r.action]
        for f, r in CATALOGUE.items()
    ]
    return markdown(("fault", "meaning", "limit", "decided", "action"), rows)


def findings() -> str:
    """Return the table of findings in recordings."""
    order = ("error", "warning", "note")
    kinds = sorted(KINDS.items(), key=lambda item: order.index(item[1].severity))
    rows = [[f"`{name}`", kind.severity, kind.meaning, kind.remedy] for name, kind in kinds]
    return markdown(("name", "severity", "meaning", "remedy"), rows)


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
    return markdown(head, rows, right=", ".join(head[1:]))


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
    return markdown(head, rows, right=", ".join(head[1:]))


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
    return markdown(head, rows, right=", ".join(head[1:]))


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
    return markdown(head, rows, right=", ".join(head[1:]))


def measured(name: str) -> list[dict[str, Any]]:
    """Return the rows of a file of results."""
    lines = (MEASURED / f"{name}.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def parameters(params: Any, names: tuple[str, ...]) -> str:
    """Return the table of the parameters of a stage, those of its parts included."""
    rows = []
    for name in ("", *names):
        part = getattr(params, name) if name else params
        meanings = docstrings(type(part))
        for f in fields(part):
            value = getattr(part, f.name)
            if not is_dataclass(value) and not isinstance(value, dict):
                unit, _, meaning = meanings[f.name].replace("\n", " ").partition("]")
                named = [
                    f"`{name}{'.' * bool(name)}{f.name}`",
                    f"`{value}`" if value in (None, True, False) else f"`{value:g}`",
                    unit.lstrip("["),
                ]
                rows.append([*named, " ".join(meaning.split())])
    return markdown(("parameter", "default", "unit", "meaning"), rows)


def ablation() -> str:
    """Worth of each mechanism of the joint filter."""
    return tables((MEASURED / "ablation.jsonl").read_text().splitlines()) + "\n"


TABLES: dict[str, Callable[[], str]] = {
    "ablation": ablation,
    "alignment": alignment,
    "faults": faults,
    "findings": findings,
    "second-world": second_world,
    "own-trackers": own_trackers,
    "time-to-ok": time_to_ok,
    "tracker-cost": tracker_cost,
    "policy-results": policy_results,
    "room-results": room_results,
    "recording-results": recording_results,
    "mds-results": mds_results,
    "filter-parameters": partial(
        parameters,
        JointParams(),
        ("range_error", "nlos", "noise_learning", "update", "start", "alignment", "supervision"),
    ),
    "orientation-parameters": partial(
        parameters, OrientationParams(), ("bias", "rest", "magnetic", "sanity")
    ),
    "sizes": sizes,
    **{f"observation-{mode}": partial(observations, mode) for mode in OBSERVATIONS},
    "actions-continuous": continuous,
    "actions-discrete": discrete,
    "weights": weights,
    "arguments": arguments,
    "scenarios": scenarios,
    "training": training,
    **{f"driver-{name}": partial(driver, name) for name in DRIVERS},
    "wire-header": lambda: markdown(*header_table(), right="offset"),
    "wire-messages": lambda: markdown(*message_table()),
    "decoders": decoders,
    "safety-rules": safety_rules,
    "safety-limits": safety_limits,
}
"""Name of a table to the function that returns it."""


def rewrite(text: str) -> str:
    """Return a page with regenerated tables.

    Raises:
        KeyError: The page has an unknown table.
    """
    return BLOCK.sub(lambda match: f"{match[1]}{TABLES[match[2]]()}{match[3]}", text)


def main(check: bool) -> list[str]:
    """Return the names of pages with outdated tables; rewrite the pages unless `check`."""
    differ = []
    for page in (*sorted(DOCS.rglob("*.md")), ROOT / "README.md"):
        old = page.read_text()
        new = rewrite(old)
        if new != old:
            differ.append(page.name)
            if not check:
                page.write_text(new)
    return differ


if __name__ == "__main__":
    changed = main("--check" in sys.argv[1:])
    print(", ".join(changed) if changed else "nothing to change")
    sys.exit(1 if changed and "--check" in sys.argv[1:] else 0)
