"""Formation errors and collisions of all controllers, on `SEEDS`; takes one to two minutes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from gymnasium.utils import seeding

from agents.controllers import CONTROLLERS
from agents.simulation.demo import SETTLE
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.timing import DECISION

SEEDS = range(16)
SECONDS = 60.0
RUNS = (("ring", "cars-nlos"), ("hold", "ring-nlos"), ("travel", "hall"))
NEAR = 0.5
"""[m] Distance between the centres of cars below which a contact is one of cars."""


def measure(
    controller: str | None,  # None: consensus without estimates of other cars
    task: str,
    scenario: str,
    observation: str,
    proximity: int = 0,
    seeds: Sequence[int] = SEEDS,
) -> list[float]:
    """Return the mean formation error [m], contacts with cars and with obstacles [1/(min car)]."""
    steps = round(SECONDS / DECISION)
    parts = configure(
        {
            "task": task,
            "scenario": scenario,
            "observation": observation,
            "proximity": proximity,
            "max_cycles": steps + 1,
        }
    )
    formation = EnvCore(parts, len(seeds))
    for e, seed in enumerate(seeds):
        formation.seed(e, seeding.np_random(seed)[0])
        formation.begin([e])
    driver = CONTROLLERS[controller or "consensus"](parts.mode.fields)
    errors, cars, others = [], 0.0, 0.0
    for _ in range(steps):
        seen = formation.observations.copy()
        if controller is None:
            seen[..., : parts.n_cars - 1] = 0.0
        formation.step(*parts.actions.decode(driver.act(seen), "actions"))
        errors.append(np.where(formation.active, formation.task.error, np.nan))
        pos = formation.state.pos_w
        apart = np.linalg.norm(pos[:, :, None] - pos[:, None], axis=-1)
        apart[:, range(parts.n_cars), range(parts.n_cars)] = np.inf
        near, contacts = apart.min(axis=-1) < NEAR, formation.loop.swarm.contacts
        cars, others = cars + contacts[near].sum(), others + contacts[~near].sum()
    minutes = len(seeds) * parts.n_cars * SECONDS / 60.0
    settled = np.nanmean(np.array(errors)[round(SETTLE / DECISION) :])
    return [float(settled), cars / minutes, others / minutes]


def main() -> None:
    """Print the rows of the table."""
    rows = [
        (n, o)
        for n, c in CONTROLLERS.items()
        for o in c.observations  # type: ignore[attr-defined]
    ]
    for name, observation in [*rows, (None, "estimate")]:
        cells = []
        for task, scenario in RUNS:
            error, cars, others = measure(name, task, scenario, observation)
            cells.append(f"{error:.3f} ({cars:.1f}, {others:.1f})")
        print(f"| {name or 'command alone'} | {observation} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
