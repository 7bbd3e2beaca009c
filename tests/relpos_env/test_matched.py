"""Filter parameters for the simulated world, against that world."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.simulation.simulate import simulate
from relpos_env.core.oracle_params import (
    ENTER_RATE,
    LEAVE_RATE,
    NEVER,
    SIDEWAYS,
    can_hide,
    matched_params,
)
from relpos_env.scenarios import recordable
from relpos_env.sensors.radio.channel import EXACT

MEASURES = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "measure_world.py"))


@pytest.fixture(scope="module")
def drives():
    """Simulate sixteen drives of cars-nlos."""
    return [simulate(scenario="cars-nlos", seconds=60.0, seed=seed) for seed in range(400, 416)]


@pytest.mark.parametrize(("name", "hides"), [
    ("cars-los", False), ("open", False), ("cars-nlos", True), ("human", True), ("hall", True),
])  # fmt: skip
def test_sight_is_lost_only_where_something_may_hide(name, hides):
    scenario = recordable(name)
    assert can_hide(scenario) == hides
    nlos = matched_params(scenario).nlos
    assert (
        nlos.los_to_nlos_rate
        == nlos.los_to_nlos_rate_with_power
        == (ENTER_RATE if hides else NEVER)
    )
    assert nlos.nlos_to_los_rate == nlos.nlos_to_los_rate_with_power == LEAVE_RATE


def test_obstacles_that_are_drawn_for_episodes_hide_as_well():
    scenario = recordable("cars-los")
    drawn = replace(scenario.randomisation, obstacles=(1, 2))
    assert can_hide(replace(scenario, randomisation=drawn))


def test_power_gaps_scatter_as_much_as_they_are_said_to(drives):
    gap, clear = np.concatenate([MEASURES["sight"](log)[1] for log in drives]).T
    nlos = matched_params(recordable("cars-nlos")).nlos
    # Power differences of a drive are correlated: eight drives have tens of independent ones.
    assert gap[clear == 1].std() == pytest.approx(nlos.power_diff_los_std, rel=0.25)
    assert gap[clear == 0].std() == pytest.approx(nlos.power_diff_nlos_std, rel=0.25)


def test_sight_is_lost_and_found_as_often_as_is_said(drives):
    seen, hidden, lost, found = sum(MEASURES["sight"](log)[0] for log in drives)
    # 150 changes each way, many of them in the same drive.
    assert lost / seen == pytest.approx(ENTER_RATE, rel=0.4)
    assert found / hidden == pytest.approx(LEAVE_RATE, rel=0.4)


def test_tyres_slip_as_far_in_eight_seconds_as_white_noise_would(drives):
    joint = matched_params(recordable("cars-nlos"))
    means = np.concatenate([MEASURES["slips"](log)[-1] for log in drives])
    n = MEASURES["SPANS"][-1] / MEASURES["PERIOD"]
    assert joint.vehicles["car"].sideways_std == SIDEWAYS
    assert np.sqrt(np.mean(means**2) * n) == pytest.approx(SIDEWAYS, rel=0.4)


def test_an_exact_channel_still_has_parameters():
    scenario = recordable("cars-los")
    radio = replace(scenario.radio, channel=EXACT)
    nlos = matched_params(replace(scenario, radio=radio)).nlos
    assert nlos.power_diff_los_std > 0.0
    assert nlos.power_diff_nlos > nlos.power_diff_los
