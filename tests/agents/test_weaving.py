"""Cars that weave while they are uncertain, and what it is worth."""

import numpy as np
import pytest

from agents import compare
from agents.controllers import Consensus, Weaving, WeavingParams
from relpos_env.interface.observations import observation_mode

FIELDS = observation_mode("estimate_cov", 3).fields
WHERE = {}
for f in FIELDS:
    first = max((w.stop for w in WHERE.values()), default=0)
    WHERE[f.name] = slice(first, first + f.size)


def observed(std, steering=0.0):
    """Return an observation of a car on its way, with others at their targets."""
    row = np.zeros(sum(f.size for f in FIELDS), np.float32)
    row[WHERE["mask"]] = row[WHERE["has_target"]] = 1.0
    row[WHERE["pos"]] = row[WHERE["target"]] = [1.0, 0.0, 0.5, 0.8]
    row[WHERE["std"]] = [std, std, 0.0] * 2
    row[WHERE["command"]], row[WHERE["heading"]] = [0.7, 0.0], [1.0, 0.0]
    row[WHERE["motion"]] = [0.7, steering]
    return row


def test_certain_cars_drive_as_by_consensus():
    rows = np.stack([observed(0.02), observed(0.02, steering=0.2)])
    np.testing.assert_array_equal(Weaving(FIELDS).act(rows), Consensus(FIELDS).act(rows))


@pytest.mark.parametrize("steering", [0.1, -0.1])
def test_uncertain_cars_keep_turning_to_their_side(steering):
    plain, weaves = (
        build(FIELDS).act(observed(0.15, steering))[1] for build in (Consensus, Weaving)
    )
    assert np.sign(weaves - plain) == np.sign(steering)


def test_an_uncertain_car_turns_back_beyond_the_width():
    row = observed(0.15, steering=0.2)
    row[WHERE["command"]] = 0.7 * np.array([np.cos(-0.15), np.sin(-0.15)])  # to the right
    weaving = Weaving(FIELDS, WeavingParams(width=0.1, push=0.1))
    assert weaving.act(row)[1] < Consensus(FIELDS).act(row)[1]


def test_without_covariances_it_always_weaves():
    fields = observation_mode("estimate", 3).fields
    row = np.zeros(sum(f.size for f in fields), np.float32)
    first = 0
    for f in fields:
        values = {"mask": 1.0, "command": [0.7, 0.0], "heading": [1.0, 0.0], "motion": [0.7, 0.1]}
        row[first : first + f.size] = values.get(f.name, 0.0)
        first += f.size
    assert Weaving(fields).act(row)[1] > Consensus(fields).act(row)[1]


def test_it_makes_estimates_better_and_keeps_the_formation():
    result = compare(
        drivers=["consensus", "weaving"],
        tasks=["observe"],
        scenarios=["open"],
        observations=["estimate_cov"],
        episodes=8,
        seconds=40.0,
        first_seed=60,
    )
    plain, weaving = result.records
    assert weaving["tracking_error"] < 0.85 * plain["tracking_error"]
    assert weaving["formation_error"] < 1.2 * plain["formation_error"]
