"""Headings and rotations of simulated cars at rest and after the first motion."""

import numpy as np

from agents.simulation.simulate import simulate
from relpos_env.core.oracle_params import matched_params
from relpos_env.scenarios import recordable
from relpos_env.timing import STAND_STILL
from tracking import Tracker, TrackerParams
from tracking.filters.joint.hypotheses.alignment import Alignment
from tracking.filters.params import FilterParams
from tracking.geometry import best_rotation


def test_standing_does_not_tell_how_a_group_is_turned():
    """Six cars, eight metres apart, join in sequence and drive after two seconds of ranges."""
    log = simulate(scenario="open", seconds=5.0, seed=1)
    tracker = Tracker(log.constellation)
    t = log.block.t[0]
    tracker.step(log.block.take(t <= STAND_STILL - 0.1), STAND_STILL - 0.1)
    group = tracker.save()["filter"].group[0, 0]
    assert group["alignment"] == Alignment.STATIC
    assert np.sqrt(group["heading_gauge_var"]) > 0.05
    until = STAND_STILL + 2.0
    estimate = tracker.step(log.block.take((t > STAND_STILL - 0.1) & (t <= until)), until)
    truth, _ = log.truth.pairs(log.constellation, np.array([until]))
    R = best_rotation(estimate.pos_ij_w, truth, planar=True)[0]  # noqa: N806
    turn = np.arctan2(R[1, 0], R[0, 0])
    assert abs(turn) < 4.0 * np.sqrt(tracker.save()["filter"].group["heading_gauge_var"][0, 0])
    assert abs(turn) < 0.12


def test_headings_are_uncertain_until_cars_have_driven():
    """Magnetometers have errors of degrees, constant at rest, that depend on the position."""
    log = simulate(scenario="cars-los", seconds=20.0, seed=3)
    joint = matched_params(recordable("cars-los"))
    car = joint.vehicles["car"]
    tracker = Tracker(log.constellation, TrackerParams(filter=FilterParams(joint=joint)))
    std = []
    for start, end in ((0.0, STAND_STILL + 0.2), (STAND_STILL + 0.2, 19.0)):
        t = log.block.t[0]
        tracker.step(log.block.take((t > start) & (t <= end)), end)
        state = tracker.save()["filter"]
        h, at = state.group["best"][0, 0], state.nodes["i_heading"][0]
        std.append(np.sqrt(state.P[0, h, at, at]))
    assert (std[0] > 0.9 * car.first_heading_std).all()
    assert (std[1] < car.heading_std + 0.01).all()
