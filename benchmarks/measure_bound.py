"""Lower bound of the formation error on estimates, for `docs/benchmarks/results.md`.

Targets are relative positions. A driver that uses the tracker's measurements cannot place a car
more accurately than the relative positions can be estimated: formation errors are bounded by their
posterior Cramer-Rao bound (`tracking.metrics.bound`), along the measured drives, in the task that
the policy was trained for. The bound is a root mean square; the mean length of a Gaussian vector is
at least sqrt(2 / pi) of it, the value for one dimension. Distance sensors are not in the bound.

Run `python benchmarks/measure_bound.py [POLICY] [EPISODES]`; some seconds per episode. Seeds from
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
    """Return formation and tracking error of an episode, the bound as rms and least mean [m]."""
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
        samples = [[info[key] for info in infos.values() if key in info] for key in MEASURES]
        errors.append([np.mean(values) if values else np.nan for values in samples])
    bound = posterior_bound(env.recorded_log("drive"), matched_params(env.scenario), skip=SETTLE)
    formation, tracking = np.nanmean(errors[round(SETTLE / DECISION) :], axis=0)
    return formation, tracking, bound.rmse, math.sqrt(2.0 / math.pi) * float(bound.pair_rms.mean())


def main() -> None:
    """Print one line per episode and the means."""
    name = sys.argv[1] if len(sys.argv) > 1 else "hold-beams"
    n_episodes = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    rows = []
    for seed in range(1000, 1000 + n_episodes):
        rows.append(measure(name, seed))
        print(seed, *(f"{x:.3f}" for x in rows[-1]), flush=True)
    print("mean", *(f"{x:.3f}" for x in np.mean(rows, axis=0)))


if __name__ == "__main__":
    main()
