"""Measure the figures of docs/explanation/safety.md.

PYTHONPATH=.:tests/hardware_bridge python tests/hardware_bridge/measure_safety.py
"""

from safety_faults import KINDS
from safety_world import CORNER, ROOM, run

from hardware_bridge.safety.params import SafetyParams

WIRED = tuple(kind for kind in KINDS if kind != "unlinked")
RUNS, SECONDS = 500, 5.0
CASES = (
    ("all but lost ports", WIRED, {}, range(4)),
    ("none", ("none",), {}, range(2)),
    ("lost ports alone", ("unlinked",), {}, range(2)),
    ("lost ports alone, `reaction = 0.45`", ("unlinked",), {"reaction": 0.45}, range(2)),
    ("all but lost ports, `max_speed = 0.5`", WIRED, {"max_speed": 0.5}, range(2)),
)


def row(name, kinds, options, seeds):
    outcomes = [
        run(
            SafetyParams(fence=(ROOM, CORNER)[seed % 2], **options),
            RUNS,
            SECONDS,
            seed,
            kinds=kinds,
        )
        for seed in seeds
    ]
    near = sum((o.nearest < SafetyParams().separation).sum() for o in outcomes)
    out = sum((o.furthest > 0.0).sum() for o in outcomes)
    nearest = min(o.nearest.min() for o in outcomes)
    furthest = max(o.furthest.max() for o in outcomes)
    way = sum(o.way.sum() for o in outcomes)
    cells = (
        name, f"{seeds.start} to {seeds.stop - 1}", f"{RUNS * len(seeds)}", f"{way:.0f} m",
        f"{near}", f"{nearest:.3f} m", f"{out}", f"{furthest:+.3f} m",
    )  # fmt: skip
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    for case in CASES:
        print(row(*case), flush=True)
