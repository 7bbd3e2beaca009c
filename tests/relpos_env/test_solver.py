"""Leaving the rigid-body solver out where nothing touches changes no bit.

The order in which the solver takes several contacts at a time depends on what its space had
before, so that both runs begin every encounter with a new space.
"""

import numpy as np
import pytest
from runs import bits, busy

from relpos_env.drivers import LoopDrivers
from relpos_env.interface.actions import DriveCommand
from relpos_env.scenarios import SCENARIOS, draw_episode
from relpos_env.swarm import Swarm

ALWAYS = 1 << 30
FIELDS = ("body", "drive", "accel", "contacts", "box_body", "boxes", "present")


class Wild:
    """Full speed this way and that."""

    def __init__(self, n_cars, rng):
        self._n, self._rng, self._left = n_cars, rng, 0

    def command(self, state):
        if self._left == 0:
            self._left = 8
            self._speed = self._rng.uniform(-2.0, 2.5, self._n)
            self._steering = self._rng.uniform(-0.42, 0.42, self._n)
        self._left -= 1
        return DriveCommand(float(state.t), self._speed, self._steering)


def run(scenario, seed, seconds, drivers, free=None):
    """The truth after every step of physics, where nothing touched, contacts.

    With `free`, the solver makes every move, with a new space in those steps.
    """
    n = scenario.n_cars
    swarm = Swarm(scenario, n, n_steps=1)
    rng = np.random.default_rng(seed)
    swarm.begin(0, draw_episode(scenario, n, seconds, rng), rng)
    driver = drivers(scenario, np.random.default_rng(seed))
    trace, unsolved, contacts = [], [], 0.0
    for step in range(round(seconds * 100)):
        if step % 10 == 0:
            command = driver.command(swarm.state.take(0))
        if free is not None:
            # The solver keeps a room for so many steps after it was needed last.
            swarm._bodies.calm[:] = ALWAYS
        if free is not None and (free[step] or (step > 0 and free[step - 1])):
            swarm._groups[0].close_room(swarm._solver, 0)
        swarm.step(command.speed[None], command.steering[None])
        unsolved.append(swarm._bodies.calm[0] == 0)
        contacts += swarm.contacts.sum()
        trace.append([getattr(swarm._bodies, name).tobytes() for name in FIELDS])
    trace.append(bits(list(swarm._scene)))
    return trace, unsolved, contacts


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
def test_the_solver_is_needed_only_when_something_touches(scenario, drivers, seconds, seed):
    now_and_then, free, contacts = run(scenario, seed, seconds, drivers)
    always, none, _ = run(scenario, seed, seconds, drivers, free)
    assert any(free)
    assert not all(free)
    assert not any(none)
    assert contacts > 0
    differing = [k for k, (a, b) in enumerate(zip(now_and_then, always, strict=True)) if a != b]
    assert not differing
