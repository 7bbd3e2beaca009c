"""How small a formation error can be on estimates, for `docs/benchmarks/results.md`.

Places are relative positions. Whoever drives by what the tracker measures cannot put another car
nearer to its place than the spread of where it may be: formation errors are bounded by the
posterior Cramer-Rao bound of the relative positions (`tracking.metrics.bound`), along the drives
that are measured, in the task that the policy was trained for. That is a root mean square; the mean
length of a Gaussian is at least sqrt(2 / pi) of it, where it lies on a line. What beams tell of
walls is not in it.

Run `python benchmarks/measure_bound.py [POLICY] [EPISODES]`; some seconds an episode. Seeds from
1000, 60 s each.
"""

from __future__ import annotations

import math
import sys

import numpy as np

from agents.policies import Layout, load_policy
from relpos_env import formation_v0
from relpos_env.core.oracle_params import matched_params
from relpos_env.timing import DECISION
from tracking.metrics.bound import posterior_bound

SCENARIO, N_CARS = "cars-nlos", 3
SECONDS, SETTLE = 60.0, 10.0
MEASURES = "formation_error", "tracking_error"


def measure(name: str, seed: int) -> tuple[float, float, float, float]:
    """Formation and tracking error of an episode, bound as rms and as least mean [m]."""
    policy = load_policy(name)
    proximity = policy.card.layout.proximity
    env = formation_v0.parallel_env(
        scenario=SCENARIO,
        task=policy.card.training["task"],
        observation="estimate",
        proximity=proximity,
        record=True,
        max_cycles=round(SECONDS / DECISION),
    )
    driver = policy.driver(Layout("estimate", N_CARS, 1, proximity))
    observations, _ = env.reset(seed=seed)
    errors = []
    while env.agents:
        actions = {agent: driver.act(seen) for agent, seen in observations.items()}
        observations, _, _, _, infos = env.step(actions)
        told = [[info[key] for info in infos.values() if key in info] for key in MEASURES]
        errors.append([np.mean(values) if values else np.nan for values in told])
    bound = posterior_bound(env.recorded_log("drive"), matched_params(env.scenario), skip=SETTLE)
    formation, tracking = np.nanmean(errors[round(SETTLE / DECISION) :], axis=0)
    return formation, tracking, bound.rmse, math.sqrt(2.0 / math.pi) * float(bound.pair_rms.mean())


def main() -> None:
    """Print a line for each episode and the means."""
    name = sys.argv[1] if len(sys.argv) > 1 else "hold-beams"
    n_episodes = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    rows = []
    for seed in range(1000, 1000 + n_episodes):
        rows.append(measure(name, seed))
        print(seed, *(f"{x:.3f}" for x in rows[-1]), flush=True)
    print("mean", *(f"{x:.3f}" for x in np.mean(rows, axis=0)))


if __name__ == "__main__":
    main()
