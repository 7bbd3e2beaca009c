"""One tracker for the group against a tracker on each car, at several losses of messages.

For `docs/benchmarks/tracker.md`: cars drive laps round the obstacle of cars-nlos. Errors are those
of the cars' views, predicted to the present, from 8 s of driving on.

Run `python benchmarks/measure_own_trackers.py [ENVS] [FIRST SEED]`; writes
`benchmarks/results/own-trackers.jsonl`.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.scenarios.cars import CARS_NLOS
from relpos_env.simulation.scripted_driver import LoopDrivers

OUT = Path(__file__).parent / "results" / "own-trackers.jsonl"
LOSSES = (None, 0.05, 0.2, 0.5)
"""[-] Probability that a message is lost on a path; None for the scenario's own."""
STEPS, SETTLE = 500, 80
WRONG = 0.5
"""[m] Position error above which a pair is wrong."""


def drive(trackers: str, loss: float | None, n_envs: int, first: int) -> dict[str, Any]:
    """Drive and return errors [m] and shares."""
    scenario = CARS_NLOS
    if loss is not None:
        channel = replace(
            scenario.radio.channel,
            loss=loss,
            loss_nlos=max(loss, scenario.radio.channel.loss_nlos),
        )
        scenario = replace(scenario, radio=replace(scenario.radio, channel=channel))
    parts = configure({"scenario": scenario, "trackers": trackers, "max_cycles": STEPS + 1})
    core = EnvCore(parts, n_envs)
    for env in range(n_envs):
        core.seed(env, np.random.default_rng(first + env))
    core.begin(range(n_envs))
    n = parts.n_cars
    drivers = [LoopDrivers(scenario, np.random.default_rng([first, k]), n) for k in range(n_envs)]
    others = ~np.eye(n, dtype=bool)
    errors, oks, disagreements, ranges = [], [], [], 0.0
    for step in range(STEPS):
        commands = [d.command(core.state.take(k)) for k, d in enumerate(drivers)]
        core.step(np.stack([c.speed for c in commands]), np.stack([c.steering for c in commands]))
        events = core.loop.swarm.events
        ranges += float((events.valid & events.has_power).sum())
        if step < SETTLE:
            continue
        pos, view = core.state.pos_w, core.loop.view
        off = np.linalg.norm(view.pos - (pos[:, None] - pos[:, :, None]), axis=-1)
        errors.append(off[:, others])
        oks.append(view.ok[:, others])
        disagreement = core.infos()["disagreement"]
        disagreements.append(disagreement[np.isfinite(disagreement)])
    off, ok = np.stack(errors), np.stack(oks)
    of_env = np.sqrt((off**2).mean(axis=(0, 2)))
    return {
        "trackers": trackers,
        "loss": loss,
        "envs": n_envs,
        "error": float(np.median(of_env)),
        "error_mean": float(of_env.mean()),
        "ok": float(ok.mean()),
        "wrong": float((ok & (off > WRONG)).mean()),
        "disagreement": float(np.sqrt((np.concatenate(disagreements) ** 2).mean())),
        "ranges_hz": ranges / (n_envs * STEPS * 0.1 * n * (n - 1) / 2),
    }


def main() -> None:
    """Measure all losses and write the results."""
    given = [int(x) for x in sys.argv[1:]]
    n_envs, first = [*given, *(40, 12000)[len(given) :]][:2]
    lines = []
    for loss in LOSSES:
        for trackers in ("group", "own"):
            lines.append(drive(trackers, loss, n_envs, first))
            print(json.dumps(lines[-1]), flush=True)
    OUT.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")


if __name__ == "__main__":
    main()
