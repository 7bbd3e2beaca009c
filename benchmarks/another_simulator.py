"""Cases of the second world for `agents.evaluation`: an independent simulator of cars.

Its logs and bounds are those of `tests/second_world`; the mounts of the trackers are unknown.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from agents.evaluation.suites import Case, Suite
from relpos_env.scenarios.cars import CARS_NLOS
from tests.second_world.record import matched, record
from tests.second_world.world import draw
from tracking.filters.joint.params import JointParams
from tracking.log import Log

FIRST = 1000
"""Number of the first world, that of seed 0."""


class AnotherSimulator(Case):
    """Cars of the second world; the scenario of the case gives the name only."""

    def log(self, seed: int, seconds: float) -> Log:
        """Simulate the log of one seed, as `Case.log`."""
        return record(draw(FIRST + seed, seconds=seconds))

    def bound_params(self, seed: int) -> JointParams:
        """Return the parameters that match the world of one seed."""
        return matched(draw(FIRST + seed))


SUITE = Suite(
    name="another-simulator",
    title="Cars of an independent simulator",
    cases=(
        AnotherSimulator(
            name="another simulator",
            about="three to five cars of the second world, mounts unknown",
            scenario=CARS_NLOS,
        ),
    ),
    seeds=50,
    seconds=60.0,
)
