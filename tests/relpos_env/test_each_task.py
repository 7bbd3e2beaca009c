"""Each task: goals, end, and assignment of places when cars come and go."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from relpos_env.scenarios import Gap
from relpos_env.tasks import TASKS, make_task

ROOM = (9.0, 8.0)
ALL = slice(None)
PLACED = [name for name in TASKS if name != "rendezvous"]
OPEN_PATH = {"path": [(-2.5, -2.0), (0.0, -2.0), (1.5, 1.0)]}


def rooms(n_envs, n_cars, seed=0, absent=0.0):
    rng = np.random.default_rng(seed)
    vel, accel = rng.normal(size=(2, n_envs, n_cars, 2))
    return SimpleNamespace(
        pos_w=rng.uniform(-3.0, 3.0, (n_envs, n_cars, 2)),
        vel_w=vel,
        accel_w=accel,
        clearance=rng.uniform(0.0, 0.5, (n_envs, n_cars)),
        present=rng.uniform(size=(n_envs, n_cars)) >= absent,
    )


def update(task, state, t):
    n_envs = len(state.present)
    task.update(state, np.full(n_envs, float(t)), np.zeros(state.present.shape), ALL)


def begun(name, state, **options):
    n_envs, n_cars = state.present.shape
    task = make_task(name, n_cars, n_envs, ROOM, **options)
    task.reset(state, ALL)
    update(task, state, 0.0)
    return task


def test_rendezvous_error_is_the_distance_from_the_middle_beyond_the_radius():
    state = rooms(4, 6, seed=5, absent=0.3)
    task = begun("rendezvous", state, radius=1.1)
    for env, present in enumerate(state.present):
        pos = state.pos_w[env, present]
        expected = np.maximum(np.linalg.norm(pos - pos.mean(axis=0), axis=1) - 1.1, 0.0)
        assert np.allclose(task.error[env, present], expected)
    assert not task.plan.any()


@pytest.mark.parametrize("name", PLACED)
def test_cars_that_come_and_go_are_given_places(name):
    state = rooms(1, 6, seed=4)
    state.present[0] = [True, True, True, True, False, False]
    task = begun(name, state)
    seen = [[0, 1, 2, 3], [0, 2, 3], [0, 2, 3, 5], [2, 3, 4, 5], [], [1], [0, 1, 2, 3, 4, 5]]
    for k, cars in enumerate(seen):
        state.present[0] = np.isin(np.arange(6), cars)
        for t in (2.0 * k, 2.0 * k + 100.0):
            update(task, state, t)
            goals = task.goal_w[0, cars]
            if name != "gap" or t > 100.0:
                # In a gap task, waiting cars stay in place.
                gaps = [np.linalg.norm(a - b) for a, b in itertools.combinations(goals, 2)]
                assert min(gaps, default=1.0) > 0.45
            assert np.all(np.abs(goals) < np.array(ROOM) / 2)
            assert task.has_target[0].sum() == len(cars) * (len(cars) - 1)
            assert np.isfinite(task.plan).all()


def test_places_stay_when_nothing_changes_but_the_shift():
    state = rooms(1, 8, seed=6)
    task = begun("hold", state, shape="ring")
    goals = task.goal_w.copy()
    state.pos_w = goals + [0.5, 0.2]
    state.present[0, 7] = False
    update(task, state, 1.0)
    state.present[0, 7] = True
    update(task, state, 2.0)
    assert np.allclose(task.goal_w, goals)


@pytest.mark.parametrize(
    ("name", "options"), [("gap", {}), ("rendezvous", {}), ("travel", OPEN_PATH)]
)
def test_done_when_the_cars_have_followed_their_goals(name, options):
    state = rooms(2, 4, seed=11)
    state.present[1, 2] = False
    task = begun(name, state, **options)
    assert not task.done.any()
    first = None
    for t in np.arange(0.1, 60.0, 0.1):
        state.pos_w = task.goal_w.copy()
        update(task, state, t)
        if first is None and task.done.all():
            first = t
    assert first is not None
    assert task.done.all()
    assert np.array_equal(task.rewards[..., task.terms.index("time")], np.zeros((2, 4)))
    if name == "rendezvous":
        assert 2.0 <= first < 2.2
    state.pos_w = state.pos_w + np.arange(4.0)[:, None]
    update(task, state, 60.0)
    assert not task.done.any()


@pytest.mark.parametrize("name", ["hold", "ring", "follow", "travel"])
def test_what_has_no_end_is_never_done(name):
    state = rooms(1, 3)
    task = begun(name, state)
    for t in (0.1, 10.0, 1e4):
        update(task, state, t)
        state.pos_w = task.goal_w.copy()
        update(task, state, t)
        assert not task.done.any()


def test_cars_pass_the_gap_one_by_one_and_not_through_the_wall():
    gap = Gap(x=0.5, y=-1.0, width=0.8)
    state = rooms(1, 6, seed=12)
    state.pos_w[0, :, 0] = np.linspace(-4.0, -0.6, 6)
    state.pos_w[0, 5, 0] = 2.0
    task = begun("gap", state, gap=gap)
    crossed, last = {}, task.goal_w[0].copy()
    for t in np.arange(0.05, 60.0, 0.05):
        update(task, state, t)
        now = task.goal_w[0]
        for car in range(6):
            if last[car, 0] < 0.5 <= now[car, 0]:
                assert abs(now[car, 1] + 1.0) < 0.1
                crossed[car] = t
        last = now.copy()
    assert sorted(crossed) == [0, 1, 2, 3, 4]
    times = np.sort(list(crossed.values()))
    assert np.diff(times).min() > 1.0
    boxes = gap.wall(ROOM)
    assert sum(b.width for b in boxes) == pytest.approx(ROOM[1] - 0.8)


def test_ring_starts_where_the_cars_stand_and_turns():
    angle = np.radians([10.0, 140.0, 245.0])
    state = rooms(1, 3)
    state.pos_w[0] = 1.4 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    task = make_task("ring", 3, 1, (5.0, 5.0))
    task.reset(state, ALL)
    update(task, state, 0.0)
    # The mean of the angles' distances from 0, 120 and 240 degrees, as directions.
    phase = np.angle(np.mean(np.exp(1j * (angle - 2.0 * np.pi * np.arange(3) / 3))))
    places = phase + 2.0 * np.pi * np.arange(3) / 3
    expected = 1.4 * np.stack([np.cos(places), np.sin(places)], axis=1)
    # Cars are put on the loop to 3 cm.
    assert np.allclose(task.goal_w[0], expected, atol=0.015)
    later = places + 0.3 / 1.4
    forward = np.stack([-np.sin(later), np.cos(later)], axis=1)
    assert np.allclose(task.plan[0], forward, atol=0.015)


def test_a_long_ring_has_even_places_and_constant_speed():
    state = rooms(1, 4, seed=3)
    task = begun("ring", state, half_axes=(1.0, 2.5), lookahead=0.0)
    length = 2.0 * np.pi + 4.0 * 1.5
    before = task.goal_w[0].copy()
    # A quarter of the loop later every car is in the next one's place.
    update(task, state, length / 4.0)
    distance = np.linalg.norm(task.goal_w[0][:, None] - before[None], axis=-1)
    assert np.allclose(np.sort(distance.min(axis=1)), 0.0, atol=0.05)
    assert np.all(distance.argmin(axis=1) != np.arange(4))
    for t in np.linspace(0.0, 9.0, 30):
        update(task, state, t)
        assert np.allclose(np.linalg.norm(task.plan[0], axis=1), 1.0, atol=0.02)
        assert np.all(np.abs(task.goal_w[0]) <= [1.01, 2.51])


def test_followers_keep_their_places_in_the_frame_of_the_course():
    state = rooms(1, 4, seed=13)
    task = begun("follow", state, lookahead=0.0)
    shapes = []
    for t in (0.0, 3.0, 9.0, 14.0):
        update(task, state, t)
        direction = task.plan[0, 0] / np.linalg.norm(task.plan[0, 0])
        left = np.array([-direction[1], direction[0]])
        shapes.append(task.target[0, 0] @ np.stack([direction, left], axis=1))
    assert np.allclose(shapes, shapes[0], atol=1e-9)
    assert np.all(shapes[0][1:, 0] < 0.0)
    alone = begun("follow", state, informed="leader")
    assert alone.plan[0, 0].any()
    assert not alone.plan[0, 1:].any()
    state.present[0, 0] = False
    update(alone, state, 1.0)
    assert alone.plan[0, 1].any()


def test_given_places_are_taken_as_they_are():
    given = [(0.0, 0.0), (-1.0, 0.5), (-1.0, -0.7)]
    state = rooms(1, 3)
    state.pos_w[0] = np.array(given) + [0.2, 0.3]
    task = begun("hold", state, shape=given)
    assert np.allclose(task.goal_w[0], state.pos_w[0])
    assert np.abs(task.error).max() < 1e-12


def test_who_joins_before_the_wall_queues_and_who_joins_behind_it_does_not():
    state = rooms(1, 4, seed=14)
    state.pos_w[0] = [(-2.0, 0.0), (-3.0, 0.5), (-2.5, -1.0), (2.0, 2.0)]
    state.present[0, 2:] = False
    task = begun("gap", state)
    update(task, state, 3.0)
    before = task.goal_w.copy()
    state.present[0] = True
    update(task, state, 3.0)
    # Cars under way continue; new ones start at their positions.
    assert np.allclose(task.goal_w[0, :2], before[0, :2], atol=1e-9)
    assert np.allclose(task.goal_w[0, 2:], state.pos_w[0, 2:])
    assert not task.plan[0, 2].any()
    assert task.plan[0, 3].any()
    for t in np.arange(3.0, 40.0, 0.1):
        update(task, state, t)
        state.pos_w = task.goal_w.copy()
    update(task, state, 40.0)
    assert task.done[0]
    assert np.all(task.goal_w[0, :, 0] > 0.0)


def test_followers_are_paid_for_going_along_told_or_not():
    rewards = []
    for told in ("all", "leader"):
        state = rooms(1, 3, seed=4)
        task = make_task("follow", 3, 1, ROOM, informed=told)
        task.reset(state, ALL)
        goals = []
        for t in (2.0, 2.3, 2.31):  # the reference is that of 0.3 s later
            update(task, state, t)
            goals.append(task.goal_w.copy())
        state.vel_w = (goals[2] - goals[1]) / 0.01
        update(task, state, 2.0)
        rewards.append(task.rewards[0, :, task.terms.index("velocity")])
    np.testing.assert_allclose(rewards[0], rewards[1])
    assert rewards[1].min() > 0.95
