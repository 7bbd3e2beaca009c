"""Generated tables of the documents.

python benchmarks/make_tables.py            regenerates them
python benchmarks/make_tables.py --check    fails if one differs

A table is enclosed by ``<!-- table: NAME -->`` and ``<!-- end of table -->``.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tables import algorithms, env_speed, environment, hardware, measured, tracker
from tables.api import api
from tables.markdown import markdown

from hardware_bridge.drivers import DRIVERS
from hardware_bridge.wire.tables import header_table, message_table
from relpos_env.interface.observations import OBSERVATIONS
from tracking.ahrs.params import OrientationParams
from tracking.filters.joint.params import JointParams

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
BLOCK = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end of table -->)", re.DOTALL)

TABLES: dict[str, Callable[[], str]] = {
    "ablation": measured.ablation,
    "api": api,
    "alignment": tracker.alignment,
    "faults": tracker.faults,
    "findings": tracker.findings,
    "second-world": measured.second_world,
    "own-trackers": measured.own_trackers,
    "time-to-ok": measured.time_to_ok,
    "env-speed": env_speed.speeds,
    "env-parts": env_speed.parts,
    **{f"env-growth-{name}": partial(env_speed.growth, name) for name in env_speed.CURVES},
    "tracker-cost": measured.tracker_cost,
    "policy-results": measured.policy_results,
    "observe-results": measured.observe_results,
    "algorithms": algorithms.algorithms,
    "room-results": measured.room_results,
    "recording-results": measured.recording_results,
    "mds-results": measured.mds_results,
    "filter-parameters": partial(
        tracker.parameters,
        JointParams(),
        ("range_error", "nlos", "noise_learning", "update", "start", "alignment", "supervision"),
    ),
    "orientation-parameters": partial(
        tracker.parameters, OrientationParams(), ("bias", "rest", "magnetic", "sanity")
    ),
    "sizes": environment.sizes,
    **{f"observation-{mode}": partial(environment.observations, mode) for mode in OBSERVATIONS},
    "actions-continuous": environment.continuous,
    "actions-discrete": environment.discrete,
    "weights": environment.weights,
    "arguments": environment.arguments,
    "scenarios": environment.scenarios,
    "training": environment.training,
    **{f"driver-{name}": partial(hardware.driver, name) for name in DRIVERS},
    "wire-header": lambda: markdown(*header_table(), right="offset"),
    "wire-messages": lambda: markdown(*message_table()),
    "decoders": hardware.decoders,
    "safety-rules": hardware.safety_rules,
    "safety-limits": hardware.safety_limits,
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
