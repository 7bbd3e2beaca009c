"""The formation controller: its laws, and what it does with what it is told."""

import numpy as np
import pytest

from agents.controllers import Consensus
from agents.controllers.base import split_fields
from agents.controllers.consensus import correction, drive, push, search
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.interface.observations import OBSERVATIONS, observation_mode, total_size

WHEELBASE, DT = 0.30, 0.02


def observe(mode="estimate", n_cars=3, **values):
    """An observation with some stretches filled, and its controller."""
    fields = observation_mode(mode, n_cars).fields
    observation = np.zeros(total_size(fields), np.float32)
    where = split_fields(fields)
    for name, value in values.items():
        observation[where[name]] = np.ravel(value)
    return Consensus(fields), observation


def parts(mode="estimate_cov", **values):
    controller, observation = observe(mode, **values)
    return {name: observation[s].astype(float) for name, s in controller._where.items()}


@pytest.mark.parametrize("mode", OBSERVATIONS)
def test_it_follows_the_command_alone_when_nothing_is_known(mode):
    controller, observation = observe(mode, command=[1.0, 0.0])
    np.testing.assert_allclose(controller.act(observation), [1.0 / MAX_SPEED, 0.0], atol=1e-6)


def test_it_stands_in_the_wanted_formation():
    places = [[1.0, 0.5], [-1.0, 2.0]]
    controller, observation = observe(mask=1, wanted=1, pos=places, target=places, heading=[1, 0])
    assert not controller.act(observation).any()


def test_cars_without_a_place_do_not_count():
    pos = np.array([[1.5, 0.0], [0.0, 3.0]])
    one = parts("estimate", mask=1, pos=pos, wanted=[1, 0], target=[[1.0, 0.0], [0.0, 0.0]])
    velocity = correction(one, np.array([True, True]), pos)
    np.testing.assert_allclose(velocity, [0.4, 0.0])


def test_without_any_places_cars_gather():
    pos = np.array([[1.0, 0.0], [0.0, 1.0]])
    velocity = correction(parts("estimate"), np.array([True, True]), pos)
    assert velocity[0] == pytest.approx(velocity[1])
    assert velocity[0] > 0.0


def test_an_unsure_direction_counts_less():
    """One minus the shares is what matrices say: W = (1 + P / s^2)^-1."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        ahead, left, mixed = *rng.uniform(0.01, 1.0, 2), rng.uniform(-0.95, 0.95)
        error = rng.uniform(-0.3, 0.3, 2)
        cov = np.array([[ahead**2, mixed * ahead * left], [mixed * ahead * left, left**2]])
        expected = 0.8 * np.linalg.solve(np.eye(2) + cov / 0.3**2, error)
        told = parts(n_cars=2, mask=1, wanted=1, target=[0, 0], std=[ahead, left, mixed], pos=error)
        found = correction(told, np.array([True]), error[None])
        np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_it_keeps_away_from_who_is_near():
    pos = np.array([[0.4, 0.0], [0.0, 2.0]])
    velocity = push(np.array([True, True]), pos)
    assert velocity[0] < 0.0
    assert velocity[1] == 0.0
    assert not push(np.array([False, False]), pos).any()


@pytest.mark.parametrize("bearing", np.radians([-170, -130, -100, -60, -20, 10, 50, 90, 120, 179]))
def test_a_car_gets_to_where_it_wants(bearing):
    """A kinematic car that pursues a fixed point, forwards or backwards."""
    goal = 3.0 * np.array([np.cos(bearing), np.sin(bearing)])
    pos, heading = np.zeros(2), 0.0
    gears = []
    for _ in range(600):
        to = goal - pos
        if np.linalg.norm(to) < 0.1:
            break
        ahead = np.cos(heading) * to[0] + np.sin(heading) * to[1]
        left = np.cos(heading) * to[1] - np.sin(heading) * to[0]
        action = drive(ahead, left)
        speed, steering = MAX_SPEED * action[0], MAX_STEERING * action[1]
        gears.append(np.sign(speed))
        heading += DT * speed * np.tan(steering) / WHEELBASE
        pos += DT * speed * np.array([np.cos(heading), np.sin(heading)])
    assert np.linalg.norm(goal - pos) < 0.1
    assert (gears[0] < 0) == (abs(bearing) > np.radians(110))


def test_a_search_turns_in_little_room():
    pos, heading, trace = np.zeros(2), 0.1, []
    for _ in range(1500):
        action = search(np.cos(heading), np.sin(heading))
        speed, steering = MAX_SPEED * action[0], MAX_STEERING * action[1]
        heading += DT * speed * np.tan(steering) / WHEELBASE
        pos = pos + DT * speed * np.array([np.cos(heading), np.sin(heading)])
        trace.append(pos)
    assert heading > 6 * np.pi
    assert np.ptp(trace, axis=0).max() < 1.0


def test_actions_are_in_their_space():
    rng = np.random.default_rng(1)
    for _ in range(50):
        controller, observation = observe("estimate_cov", n_cars=5)
        observation[:] = rng.uniform(-1.0, 1.0, len(observation))
        action = controller.act(observation)
        assert action.dtype == np.float32
        assert np.all(np.abs(action) <= 1.0)
