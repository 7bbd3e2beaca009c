"""Placement of a formation: clear of obstacles, and as near as possible."""

import numpy as np
import pytest

from agents.comparison.simulated import Simulated
from relpos_env.config import FormationConfig
from relpos_env.scenarios.rooms.overlap import distance
from relpos_env.tasks.geometry.anchor import CLEAR, STEP, free_anchor
from relpos_env.tasks.geometry.curves import make_curve
from relpos_env.tasks.moving import AnchorPlacement, Motion

SQUARE = 0.5 * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
BOX = np.array([[0.5, 0.5, 0.2, 0.2, 1.0, 0.0]])
HALF = np.array([2.0, 2.0])


def clearance(anchor, boxes):
    return min(distance(anchor + SQUARE, box).min() for box in boxes)


def test_it_stays_where_it_is_wanted_if_that_is_clear():
    requested = np.array([-1.03, 0.21])
    np.testing.assert_array_equal(free_anchor(requested, HALF, SQUARE, BOX), requested)
    outside = free_anchor(np.array([-5.0, 0.0]), HALF, SQUARE, BOX)
    np.testing.assert_array_equal(outside, [-2.0, 0.0])
    gone = np.zeros((2, 6))  # boxes of size zero are absent
    np.testing.assert_array_equal(free_anchor(np.zeros(2), HALF, SQUARE, gone), [0.0, 0.0])


def test_it_makes_way_by_no_more_than_it_must():
    for requested in np.random.default_rng(0).uniform(-1.0, 1.0, (30, 2)):
        found = free_anchor(requested, HALF, SQUARE, BOX)
        assert clearance(found, BOX) >= CLEAR
        shift = np.linalg.norm(found - requested)
        directions = np.linspace(0.0, 2.0 * np.pi, 90)
        ring = np.stack([np.cos(directions), np.sin(directions)], axis=1)
        for nearer in np.arange(0.0, shift - STEP, 0.02):
            assert all(clearance(requested + nearer * d, BOX) < CLEAR for d in ring)


def test_where_nothing_is_clear_it_is_the_clearest():
    boxes = np.array([[x, y, 0.3, 0.3, 1.0, 0.0] for x in (-1.0, 0.0, 1.0) for y in (-1, 0, 1)])
    half = np.array([0.5, 0.5])
    found = free_anchor(np.zeros(2), half, SQUARE, boxes)
    tried = np.random.default_rng(1).uniform(-0.5, 0.5, (200, 2))
    assert clearance(found, boxes) >= max(clearance(a, boxes) for a in tried) - STEP


@pytest.mark.parametrize("scenario", ["cars-nlos", "swarm-nlos", "ring-nlos", "hall", "rooms-9x7"])
def test_no_place_of_a_standing_formation_is_in_an_obstacle(scenario):
    parts = FormationConfig(scenario=scenario, task="hold", max_cycles=20).resolve()
    running = Simulated(parts, range(30))
    formation = running.formation
    for env in range(30):
        goals = formation.task.goal_w[env][formation.state.present[env]]
        for box in formation.loop.swarm.boxes[env]:
            if box[2] > 0.0:
                assert distance(goals, box).min() >= CLEAR - 1e-9
    # The error of the group includes the distance from it.
    present = formation.state.present[..., None]
    off = np.where(present, formation.state.pos_w - formation.task.goal_w, 0.0).sum(axis=1)
    place = np.linalg.norm(off, axis=1) / present.sum(axis=(1, 2))
    np.testing.assert_allclose(running.place_error, place)
    term = formation.task.rewards[..., formation.task.terms.index("place")]
    expected = np.where(formation.state.present, np.exp(-place)[:, None], 0.0)
    np.testing.assert_allclose(term, expected)
    running.close()


def test_a_frame_that_follows_a_curve_does_not_stand():
    curve = make_curve("loop", True, np.array([3.0, 3.0]), np.array([0.5, 0.5]))
    placement = AnchorPlacement(half=(1.0, 1.0), room=(3.0, 3.0))
    with pytest.raises(ValueError, match="placement: expected none"):
        Motion(curve=curve, placement=placement)
