"""Controllers with distance sensors: position of walls, free paths, few contacts."""

import math

import numpy as np
import pytest
from gymnasium.utils import seeding

from agents.controllers import CONTROLLERS
from agents.controllers.base import Reader, split_fields
from agents.controllers.clearance import (
    BEFORE,
    WAYS,
    ClearanceParams,
    clear_arc,
    clear_way,
    clearance_bounds,
)
from agents.controllers.surroundings import (
    HALF_LENGTH,
    HALF_WIDTH,
    NOTHING,
    Surroundings,
    surroundings,
)
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.interface.observations import observation_mode, total_size
from relpos_env.interface.rangefinders import FARTHEST, rangefinder_directions, rangefinder_origins

PARAMS = ClearanceParams()
READABLE = [(name, mode) for name, builder in CONTROLLERS.items() for mode in builder.observations]


def observe(near, mode="estimate", n_cars=3, **values):
    """Return an observation with readings, and other fields as given."""
    fields = observation_mode(mode, n_cars, len(near)).fields
    o, where = np.zeros(total_size(fields), np.float32), split_fields(fields)
    o[where["near"]] = near
    for name, value in values.items():
        o[where[name]] = np.ravel(value)
    return o, fields


def see(near, **values):
    o, fields = observe(near, **values)
    return Reader(fields, "", ("estimate",)).read(o)


def wall(normal, away, n_rangefinders):
    """Return readings of a wall in a direction at a distance from the centre of the car."""
    directions = rangefinder_directions(n_rangefinders)
    starts = rangefinder_origins(directions, HALF_LENGTH, HALF_WIDTH)
    angles = np.arctan2(directions[:, 1], directions[:, 0]) - normal
    off = np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi)
    left = away - starts * np.cos(off)
    best = np.cos(np.maximum(off - math.radians(13.5), 0.0))
    return np.where(best > 1e-6, np.minimum(left / np.maximum(best, 1e-6), FARTHEST), FARTHEST)


@pytest.mark.parametrize("n_rangefinders", [8, 16, 24])
@pytest.mark.parametrize("normal", np.linspace(-3.0, 3.0, 13))
def test_points_are_on_the_wall(n_rangefinders, normal):
    """The three sensors that point most directly at it are within 3 cm."""
    near = wall(normal, 0.6, n_rangefinders)
    around = surroundings(see(near))
    ways = around.ahead * math.cos(normal) + around.left * math.sin(normal)
    np.testing.assert_allclose(
        ways[np.argsort(near)[:3]], 0.6, atol=0.03 if n_rangefinders > 8 else 0.07
    )


def test_what_a_known_car_explains_is_no_wall():
    near = np.full(8, FARTHEST)
    near[0] = 0.6
    empty = surroundings(see(np.full(8, FARTHEST)))
    assert (empty.ahead == NOTHING).all()
    assert surroundings(see(near)).ahead[0] == pytest.approx(0.81, abs=1e-6)
    there = surroundings(see(near, mask=[1, 0], pos=[[1.0, 0.1], [0.0, 0.0]]))
    assert (there.ahead == NOTHING).all()
    unknown = surroundings(see(near, mask=[0, 0], pos=[[1.0, 0.1], [0.0, 0.0]]))
    assert unknown.ahead[0] < 1.0


def one_point(x, y):
    """Return readings of sixteen sensors, of which one detects something."""
    ahead, left = np.full((2, 16), NOTHING)
    ahead[0], left[0] = x, y
    return Surroundings(ahead, left)


@pytest.mark.parametrize("gear", [1.0, -1.0])
@pytest.mark.parametrize("away", [0.1, 0.25, 0.5, 0.8])
def test_a_clear_way_straight_on(gear, away):
    """The result is the remaining path up to the margin, cut to the paths considered."""
    point = one_point(gear * (HALF_LENGTH + PARAMS.margin + away), 0.05)
    way = clear_way(point, np.array(0.0), np.array(gear), PARAMS)
    assert way == BEFORE[np.searchsorted(WAYS, away + 1e-9)]
    assert clear_way(point, np.array(0.0), np.array(-gear), PARAMS) == np.inf
    beside = one_point(gear * 0.5, HALF_WIDTH + PARAMS.margin + 0.01)
    assert clear_way(beside, np.array(0.0), np.array(gear), PARAMS) == np.inf


def test_a_clear_way_on_an_arc():
    """A car that turns left meets an obstacle left of its bow, not one straight ahead."""
    ahead, left = one_point(0.9, 0.0), one_point(0.5, 0.35)
    curvature, forwards = np.array(1.2), np.array(1.0)
    assert clear_way(ahead, curvature, forwards, PARAMS) == np.inf
    assert clear_way(left, curvature, forwards, PARAMS) < 0.4
    assert clear_way(left, -curvature, forwards, PARAMS) == np.inf


def test_few_beams_keep_farther_off():
    """They miss obstacles between their directions."""
    near = {n: clearance_bounds(surroundings(see(wall(0.0, 0.5, n))), PARAMS) for n in (8, 16)}
    assert near[8].closing.min() < near[16].closing.min() - 0.03
    assert near[16].closing.min() == pytest.approx(2.0 * (0.29 - PARAMS.keep), abs=0.02)


def test_velocities_are_pushed_back_from_the_nearest_point_alone():
    bounds = clearance_bounds(surroundings(see(wall(0.5 * np.pi, 0.3, 16))), PARAMS)
    assert (bounds.closing < 10.0).sum() <= 2
    k = bounds.closing.argmin()
    assert bounds.closing[k] == pytest.approx(PARAMS.rate * (0.2 - PARAMS.keep), abs=0.02)
    assert bounds.toward[1][k] == pytest.approx(1.0, abs=1e-6)


def turned(near, action, speed=0.0):
    sight = see(near, motion=[speed, 0.0])
    actions = np.array(action, np.float32)
    clear_arc(surroundings(sight), sight, actions, 0.3, PARAMS)
    return actions


def test_who_sees_nothing_does_what_it_wanted():
    for action in ([0.5, 0.3], [-0.4, -1.0], [0.0, 0.0]):
        np.testing.assert_allclose(turned(np.full(16, FARTHEST), action), action, atol=1e-6)


def test_a_wall_slows_turns_and_sends_back():
    far, close = wall(0.0, 1.2, 16), wall(0.0, 0.30, 16)
    assert turned(far, [0.3, 0.0]).tolist() == pytest.approx([0.3, 0.0], abs=1e-6)
    aslant = turned(wall(-0.6, 0.6, 16), [0.5, 0.0])
    assert aslant[1] > 0.2
    assert aslant[0] > 0.2
    assert turned(close, [0.5, 0.5])[0] < 0.0
    assert abs(turned(close, [0.05, 0.0])[0]) <= 0.05
    beside = turned(wall(0.5 * np.pi, HALF_WIDTH + 0.15, 16), [0.4, 0.0])
    assert beside[0] == pytest.approx(0.4, abs=1e-6)


@pytest.mark.parametrize(("name", "mode"), READABLE)
def test_one_car_or_many_and_whatever_is_seen(name, mode):
    fields = observation_mode(mode, 4, 12).fields
    driver, rng = CONTROLLERS[name](fields), np.random.default_rng(0)
    o = rng.uniform(-1.0, 1.0, (5, 7, total_size(fields))).astype(np.float32)
    o[..., -12:] = rng.uniform(0.0, 3.0, (5, 7, 12)) * rng.integers(0, 2, (5, 7, 12))
    actions = driver.act(o)
    assert actions.shape == (5, 7, 2)
    assert np.abs(actions).max() <= 1.0
    np.testing.assert_allclose(driver.act(o[2, 3]), actions[2, 3], atol=1e-5)


def test_hardly_anybody_touches_anything():
    """In this room cars without sensors touch the wall ten times a minute."""
    touched = []
    for n_rangefinders in (0, 16):
        parts = configure({"task": "hold", "scenario": "ring-nlos", "proximity": n_rangefinders})
        formation = EnvCore(parts, 6)
        for e in range(6):
            formation.seed(e, seeding.np_random(e)[0])
            formation.begin([e])
        driver, contacts = CONTROLLERS["consensus"](parts.mode.fields), 0.0
        for _ in range(250):
            actions = driver.act(formation.observations)
            formation.step(*parts.actions.decode(actions, "actions"))
            contacts += formation.loop.swarm.contacts.sum()
        touched.append(contacts)
    assert touched[0] > 30
    assert touched[1] < 0.1 * touched[0]
