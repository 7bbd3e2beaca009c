"""Share of samples in which pairs that are OK are off by more than their protection radius.

The tracker starts at several times of a drive, walk or flight of one minute; the 15 s after each
start are scored. Prints one line per kind.

Run `python benchmarks/measure_protection.py [STARTS] [FIRST]`.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import numpy as np
from cases import Case, case

from tracking import Tracker
from tracking.measurements import Kind
from tracking.metrics.integrity import beyond_protection

KINDS = ("cars-los", "cars-nlos", "human", "hand", "drones")
PER_RUN = 10
"""[-] Starts per run."""
LENGTH = 15.0
"""[s] Time after a start that is scored."""


def started(of: Case, at: float) -> tuple[int, int]:
    """Return the number of OK samples after a start at `at` [s], and of those beyond the radius."""
    t, kind = of.block.t[0], of.block.kind[0]
    block = of.block.take(((t >= at) | (kind == Kind.SURVEY)) & (t < at + LENGTH))
    # Surveyed distances are valid from the start on.
    block = replace(block, t=np.where(block.kind == Kind.SURVEY, at, block.t))
    block = block.take(block.order()[0])
    times = (of.t >= at) & (of.t < at + LENGTH)
    who = of.constellation
    if of.heading is not None:
        # The heading of the constellation is that at the start of the run.
        mover = replace(who.nodes[0], initial_heading=of.heading(at))
        who = replace(who, nodes=(mover, *who.nodes[1:]))
    estimate = Tracker(who).run(block, of.t[times]).take(0)
    judged = of.known[times] & ~of.constellation.is_static[of.constellation.pairs].all(axis=1)
    n = int((judged & estimate.ok).sum())
    share = beyond_protection(estimate, of.truth[times], judged)
    return n, round((share or 0.0) * n)


def main() -> None:
    """Measure every kind."""
    given = [int(x) for x in sys.argv[1:]]
    n_starts, first = [*given, *(2000, 20000)[len(given) :]][:2]
    for kind in KINDS:
        counts = []
        for seed in range(first, first + n_starts // PER_RUN):
            of = case(kind, seed)
            starts = np.linspace(of.t[0], of.t[-1] - LENGTH, PER_RUN)
            counts += [started(of, float(at)) for at in starts]
            case.cache_clear()
        ok, beyond = np.array(counts).T
        line = {
            "kind": kind,
            "starts": len(counts),
            "first": first,
            "ok_samples": int(ok.sum()),
            "beyond": float(beyond.sum() / max(ok.sum(), 1)),
            "starts_beyond": float((beyond > 0).mean()),
        }
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
