"""What a filter is told of the simulated world, beside that world."""

from dataclasses import replace

import numpy as np
import pytest

from agents.simulate import simulate
from relpos_env.matched import ENTER_RATE, LEAVE_RATE, NEVER, can_hide, matched_params
from relpos_env.scenarios import recordable
from relpos_env.sensors.radio.channel import EXACT
from tracking.measurements import Kind


@pytest.fixture(scope="module")
def gaps():
    """Power gap [dB] of ranges, and whether they were hidden, of four drives of cars-nlos."""
    out = []
    for seed in range(400, 404):
        log = simulate(scenario="cars-nlos", seconds=60.0, seed=seed)
        row = log.block.kind[0] == Kind.RANGE
        values = log.block.values[0, row]
        out.append(np.stack([values[:, 1] - values[:, 2], log.nlos], axis=1))
    return np.concatenate(out).T


@pytest.mark.parametrize(("name", "hides"), [
    ("cars-los", False), ("open", False), ("cars-nlos", True), ("human", True), ("hall", True),
])  # fmt: skip
def test_sight_is_lost_only_where_something_may_hide(name, hides):
    scenario = recordable(name)
    assert can_hide(scenario) == hides
    nlos = matched_params(scenario).nlos
    assert nlos.enter_rate == (ENTER_RATE if hides else NEVER)
    assert nlos.leave_rate == nlos.leave_rate_with_power == LEAVE_RATE


def test_obstacles_that_are_drawn_for_episodes_hide_as_well():
    scenario = recordable("cars-los")
    drawn = replace(scenario.randomisation, obstacles=(1, 2))
    assert can_hide(replace(scenario, randomisation=drawn))


def test_power_gaps_scatter_as_much_as_they_are_said_to(gaps):
    gap, hidden = gaps
    nlos = matched_params(recordable("cars-nlos")).nlos
    # Gaps of a drive are alike: four drives have tens of independent ones.
    assert gap[hidden == 0].std() == pytest.approx(nlos.gap_los_std, rel=0.25)
    assert gap[hidden == 1].std() == pytest.approx(nlos.gap_nlos_std, rel=0.25)


def test_an_exact_channel_still_has_parameters():
    scenario = recordable("cars-los")
    radio = replace(scenario.radio, channel=EXACT)
    nlos = matched_params(replace(scenario, radio=radio)).nlos
    assert nlos.gap_los_std > 0.0
    assert nlos.gap_nlos > nlos.gap_los
