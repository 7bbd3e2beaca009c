"""Properties of all controllers, in every observation that they can read."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.controllers import CONTROLLERS
from agents.controllers.base import Reader, split_fields
from agents.controllers.leader_follower import FOREMOST, leader
from agents.errors import UsageError
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.interface.observations import OBSERVATIONS, observation_mode, space_of, total_size

READABLE = [(name, mode) for name, builder in CONTROLLERS.items() for mode in builder.observations]
POSITIONS = [(name, mode) for name, mode in READABLE if mode != "ranges"]
LEFT = {"pos": 2, "vel": 2, "target": 2, "command": 2, "heading": 2, "motion": 2}
"""Fields in which every second number changes sign under reflection."""


def build(name, mode="estimate", n_cars=3):
    return CONTROLLERS[name](observation_mode(mode, n_cars).fields)


def observe(mode="estimate", n_cars=3, **values):
    """Return an observation with some fields filled; those that the mode lacks are left out."""
    fields = observation_mode(mode, n_cars).fields
    observation = np.zeros(total_size(fields), np.float32)
    where = split_fields(fields)
    for stretch, value in values.items():
        if stretch in where:
            observation[where[stretch]] = np.ravel(value)
    return observation


def draw(rng, mode, n_cars, n):
    """Return observations of cars near their targets, (n, size)."""
    fields = observation_mode(mode, n_cars).fields
    where = split_fields(fields)
    o = rng.uniform(-1.0, 1.0, (n, total_size(fields))).astype(np.float32)
    for stretch in ("mask", "has_target"):
        o[:, where[stretch]] = rng.random((n, n_cars - 1)) < 0.8
    for stretch in ("pos", "target", "range"):
        if stretch in where:
            o[:, where[stretch]] *= 3.0
    angle = rng.uniform(-np.pi, np.pi, n)
    o[:, where["heading"]] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return o


def in_a_mirror(o, mode, n_cars):
    """Return the same observations with left and right exchanged.

    The room is reflected at the line along which leaders are chosen.
    """
    o = o.copy()
    where = split_fields(observation_mode(mode, n_cars).fields)
    for stretch, s in where.items():
        if stretch in LEFT:
            o[..., s.start + 1 : s.stop : 2] *= -1.0
        if stretch == "std":
            o[..., s.start + 2 : s.stop : 3] *= -1.0
    c, s = o[..., where["heading"].start], o[..., where["heading"].start + 1]
    angle = np.arctan2(s, c) + 2.0 * FOREMOST
    o[..., where["heading"]] = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return o


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("mode", OBSERVATIONS)
def test_it_reads_what_it_says_and_refuses_the_rest(name, mode):
    if mode in CONTROLLERS[name].observations:
        build(name, mode)
    else:
        with pytest.raises(UsageError, match=f"observation: {name} expects .*, got {mode}"):
            build(name, mode)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_observations_of_another_size_are_refused(name):
    with pytest.raises(UsageError, match="observations: expected a last axis of 22"):
        build(name).act(np.zeros(23, np.float32))


@settings(max_examples=40)
@given(data=st.data())
@pytest.mark.parametrize(("name", "mode"), READABLE)
def test_any_observation_gives_an_action(name, mode, data):
    """The action is valid for any observation of the space, corners and zeros included."""
    space = space_of(observation_mode(mode, 4).fields)
    size = space.shape[0]
    kind = data.draw(st.lists(st.sampled_from([0, 1, 2, 3]), min_size=size, max_size=size))
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    o = np.choose(kind, [space.low, space.high, np.zeros(size), rng.uniform(space.low, space.high)])
    action = build(name, mode, 4).act(o.astype(np.float32))
    assert action.dtype == np.float32
    assert action.shape == (2,)
    assert np.all(np.abs(action) <= 1.0)


@pytest.mark.parametrize(("name", "mode"), READABLE)
@pytest.mark.parametrize("n_cars", [2, 3, 12])
def test_a_batch_is_one_by_one_bit_for_bit(name, mode, n_cars):
    controller = build(name, mode, n_cars)
    o = draw(np.random.default_rng(0), mode, n_cars, 60).reshape(5, 12, -1)
    batch = controller.act(o)
    assert batch.shape == (5, 12, 2)
    for e in range(5):
        for k in range(12):
            np.testing.assert_array_equal(batch[e, k], controller.act(o[e, k]))


@pytest.mark.parametrize(("name", "mode"), READABLE)
def test_left_and_right_are_alike(name, mode):
    controller = build(name, mode, 4)
    o = draw(np.random.default_rng(1), mode, 4, 200)
    here, there = controller.act(o), controller.act(in_a_mirror(o, mode, 4))
    known = o[:, split_fields(observation_mode(mode, 4).fields)["mask"]].any(axis=1)
    # A search turns the same way everywhere, so that cars do not meet.
    np.testing.assert_array_equal(here[known, 0], there[known, 0])
    np.testing.assert_array_equal(here[known, 1], -there[known, 1])


@pytest.mark.parametrize(("name", "mode"), READABLE)
def test_only_the_newest_of_a_history_counts(name, mode):
    controller = build(name, mode)
    o = draw(np.random.default_rng(2), mode, 3, 6).reshape(2, 3, -1)
    np.testing.assert_array_equal(controller.act(o.reshape(2, -1)), controller.act(o[:, 0]))


@pytest.mark.parametrize(("name", "mode"), READABLE)
def test_it_follows_the_command_alone_when_nothing_is_known(name, mode):
    action = build(name, mode).act(observe(mode, command=[1.0, 0.0]))
    np.testing.assert_allclose(action, [1.0 / MAX_SPEED, 0.0], atol=1e-6)


@pytest.mark.parametrize(("name", "mode"), READABLE)
def test_it_stands_in_the_wanted_formation(name, mode):
    places = np.array([[1.0, 0.5], [-1.0, 2.0]])
    ranges = np.hypot(*places.T)
    told = dict(mask=1, has_target=1, pos=places, range=ranges, target=places, heading=[1, 0])
    assert not build(name, mode).act(observe(mode, **told)).any()


@pytest.mark.parametrize(("name", "mode"), READABLE)
def test_it_drives_to_its_place(name, mode):
    """The other car is farther ahead than its target, so the car moves there."""
    told = dict(mask=1, has_target=1, pos=[2.5, 0.0], range=2.5, target=[2.0, 0.0], heading=[1, 0])
    speed, steering = build(name, mode, 2).act(observe(mode, 2, **told))
    assert speed > 0.05
    assert steering == 0.0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_an_unsure_estimate_moves_less(name):
    """The speed falls with the standard deviation."""
    speeds = []
    for std in (0.0, 0.1, 0.3, 1.0):
        told = dict(
            mask=1, has_target=1, pos=[2.3, 0], target=[2, 0], heading=[1, 0], std=[std, std, 0]
        )
        speeds.append(build(name, "estimate_cov", 2).act(observe("estimate_cov", 2, **told))[0])
    assert np.all(np.diff(speeds) < 0.0)
    assert speeds[2] == pytest.approx(0.5 * speeds[0])


def test_an_old_range_and_one_behind_an_obstacle_move_less():
    told = dict(
        mask=1, has_target=1, range=2.3, target=[2.0, 0.0], heading=[1, 0], command=[0.5, 0]
    )
    now, old, hidden = (
        build("range-only", "ranges", 2).act(observe("ranges", 2, **told, **more))[0]
        for more in ({}, {"age": 0.5}, {"gap": 12.0})
    )
    assert now > old > 0.5 / MAX_SPEED
    assert now > hidden > 0.5 / MAX_SPEED


@pytest.mark.parametrize("name", CONTROLLERS)
def test_cars_without_a_place_do_not_count(name):
    told = dict(mask=1, pos=[[2.0, 0.0], [0.0, 3.0]], has_target=[1, 0], target=[[2, 0], [0, 0]])
    assert not build(name).act(observe(heading=[1, 0], **told)).any()


@pytest.mark.parametrize("name", CONTROLLERS)
def test_without_any_places_cars_gather(name):
    action = build(name).act(observe(mask=1, pos=[[3.0, 0.5], [3.0, -0.5]], heading=[1, 0]))
    assert action[0] > 0.3


def test_a_search_turns_in_little_room():
    controller = build("consensus")
    pos, heading, trace = np.zeros(2), 0.1, []
    for _ in range(1500):
        own = [np.cos(heading), np.sin(heading)]
        speed, steering = controller.act(observe(heading=own)) * [MAX_SPEED, MAX_STEERING]
        heading += 0.02 * speed * np.tan(steering) / 0.30
        pos = pos + 0.02 * speed * np.array([np.cos(heading), np.sin(heading)])
        trace.append(pos)
    assert heading > 6 * np.pi
    assert np.ptp(trace, axis=0).max() < 1.0


@pytest.mark.parametrize("heading", [0.0, 1.0, 2.5, -2.0])
def test_all_cars_follow_the_same_leader(heading):
    """The leader's place is farthest east by north; it follows the command only."""
    places = np.array([[0.0, 0.0], [1.0, 2.0], [-1.0, 1.0], [1.0, -1.0]])
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    reader = Reader(observation_mode("estimate", 4).fields, "", ("estimate",))
    for k in range(4):
        to = (np.delete(places, k, axis=0) - places[k]) @ turn
        told = dict(mask=1, has_target=1, target=to, heading=[np.cos(heading), np.sin(heading)])
        chosen = leader(reader.read(observe(n_cars=4, **told)))
        np.testing.assert_array_equal(np.delete(np.arange(4) == 1, k), chosen)
