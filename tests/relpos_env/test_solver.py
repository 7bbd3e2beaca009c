"""Omitting the rigid-body solver without contacts changes no bit.

The order in which the solver handles simultaneous contacts depends on the history of its space.
Fast physics starts every encounter with a new space, so it may differ after the first one.
"""

import numpy as np
import pytest
from runs import busy

from relpos_env.interface.actions import DriveCommand
from relpos_env.scenarios import SCENARIOS, draw_episode
from relpos_env.simulation.scripted_driver import LoopDrivers
from relpos_env.world.world import SPARE_BOXES, World

FIELDS = ("body", "drive", "accel", "contacts", "present")


class Wild:
    """Drivers at full speed in random directions."""

    def __init__(self, n_cars, rng):
        self._n, self._rng, self._left = n_cars, rng, 0

    def command(self, state):
        if self._left == 0:
            self._left = 8
            self._speed = self._rng.uniform(-2.0, 2.5, self._n)
            self._steering = self._rng.uniform(-0.42, 0.42, self._n)
        self._left -= 1
        return DriveCommand(float(state.t), self._speed, self._steering)


def run(scenario, seed, seconds, drivers, physics):
    """Return true states, the mask of free motion, contacts and solver steps, per physics step."""
    n = scenario.n_cars
    swarm = World(scenario, n, n_steps=1, physics=physics)
    rng = np.random.default_rng(seed)
    swarm.begin(0, draw_episode(scenario, n, seconds, rng), rng)
    driver = drivers(scenario, np.random.default_rng(seed))
    trace, calm, contacts = [], [], []
    n_boxes = swarm.boxes.shape[1] - (SPARE_BOXES if physics == "pymunk" else 0)
    for step in range(round(seconds * 100)):
        if step % 10 == 0:
            command = driver.command(swarm.state.take(0))
        swarm.step(command.speed[None], command.steering[None])
        calm.append(swarm._bodies.calm[0] == 0)
        contacts.append(swarm.contacts.sum())
        arrays = [getattr(swarm._bodies, name)[0] for name in FIELDS]
        arrays += [swarm._bodies.boxes[0, :n_boxes], swarm.events.values, swarm.events.valid]
        trace.append([array.tobytes() for array in arrays])
    return trace, calm, contacts, swarm.solver_moves


def wild(scenario, rng):
    return Wild(scenario.n_cars, rng)


CROWD = busy()
DRIVES = [
    (SCENARIOS["cars-nlos"], LoopDrivers, 30.0),
    (SCENARIOS["cars-nlos"], wild, 12.0),
    (CROWD, wild, 12.0),
    (SCENARIOS["warehouse"], wild, 8.0),
]


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("scenario", "drivers", "seconds"), DRIVES)
def test_fast_physics_is_pymunks_bit_for_bit_until_something_touches(
    scenario, drivers, seconds, seed
):
    fast, calm, contacts, moves = run(scenario, seed, seconds, drivers, "fast")
    kept, calm_too, _, all_moves = run(scenario, seed, seconds, drivers, "pymunk")
    first = next((k for k, n in enumerate(contacts) if n > 0), len(contacts))
    assert first > 20
    assert fast[:first] == kept[:first]
    assert calm[:first] == calm_too[:first]
    assert moves < all_moves == len(kept)
    assert any(calm)
    assert sum(contacts) > 0
