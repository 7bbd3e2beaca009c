"""Tasks of a batch of rooms: properties of every task."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relpos_env.errors import EnvError
from relpos_env.scenarios import Gap
from relpos_env.tasks import TASKS, DrivingTask, make_task

ROOM = (9.0, 8.0)
ALL = slice(None)
PLACED = [name for name in TASKS if name != "rendezvous"]
OPEN_PATH = {"path": [(-2.5, -2.0), (0.0, -2.0), (1.5, 1.0)]}
MOVING = [
    ("ring", {}),
    ("travel", {}),
    ("travel", {"turning": True, "path": "eight"}),
    ("travel", {**OPEN_PATH, "turning": True}),
    ("follow", {}),
    ("follow", {"path": "loop", "shape": "v"}),
    ("gap", {"gap": Gap(x=1.0, y=0.5, width=1.0)}),
]


@dataclass
class Rooms:
    """True states of a batch."""

    pos_w: np.ndarray
    vel_w: np.ndarray
    accel_w: np.ndarray
    clearance: np.ndarray
    present: np.ndarray


def rooms(n_envs, n_cars, seed=0, absent=0.0):
    rng = np.random.default_rng(seed)
    pos = rng.uniform(-3.0, 3.0, (n_envs, n_cars, 2))
    vel, accel = rng.normal(size=(2, n_envs, n_cars, 2))
    present = rng.uniform(size=(n_envs, n_cars)) >= absent
    clearance = rng.uniform(0.0, 0.5, (n_envs, n_cars))
    return Rooms(pos, vel, accel, clearance, present)


def update(task, state, t, collided=None):
    shape = state.present.shape
    collided = np.zeros(shape) if collided is None else collided
    task.update(state, np.broadcast_to(float(t), shape[:1]).copy(), collided, ALL)


def begun(name, state, **options):
    n_envs, n_cars = state.present.shape
    task = make_task(name, n_cars, n_envs, ROOM, **options)
    task.reset(state, ALL)
    update(task, state, 0.0)
    return task


def arrays(task):
    return {
        "target": task.target, "has_target": task.has_target, "plan": task.plan,
        "goal_w": task.goal_w, "error": task.error, "rewards": task.rewards, "done": task.done,
    }  # fmt: skip


def error_twin(state, task):
    """Return the formation error in plain numpy."""
    error = np.zeros(state.present.shape)
    for env, present in enumerate(state.present):
        pos = state.pos_w[env]
        off = np.linalg.norm(pos[None] - pos[:, None] - task.target[env], axis=-1)
        off *= present[:, None] & present[None, :]
        error[env] = off.sum(axis=1) / max(present.sum() - 1, 1)
    return error


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("n_cars", [2, 3, 6, 9])
def test_targets_are_antisymmetric_and_only_of_present_cars(name, n_cars):
    state = rooms(4, n_cars, absent=0.3)
    task = begun(name, state)
    for t in (0.0, 3.3, 40.0):
        update(task, state, t)
        assert np.array_equal(task.target, -np.swapaxes(task.target, 1, 2))
        both = state.present[:, :, None] & state.present[:, None, :]
        both &= ~np.eye(n_cars, dtype=bool)
        assert np.array_equal(task.has_target, both & (name != "rendezvous"))
        assert not task.target[~task.has_target].any()
        gone = ~state.present
        for array in (task.plan, task.goal_w, task.error, task.rewards):
            assert not array[gone].any()


@pytest.mark.parametrize("name", PLACED)
def test_no_error_on_the_formation_wherever_it_stands(name):
    state = rooms(3, 6, absent=0.2)
    task = begun(name, state)
    for t in (0.0, 2.2, 7.9):
        update(task, state, t)
        state.pos_w = task.goal_w + [0.3, -1.2]
        update(task, state, t)
        assert np.abs(task.error).max() < 1e-12
        assert np.allclose(task.rewards[..., 0], state.present)


@pytest.mark.parametrize("name", TASKS)
def test_error_of_the_numpy_twin_whatever_the_shift(name):
    state = rooms(5, 5, seed=3, absent=0.3)
    task = begun(name, state)
    update(task, state, 4.4)
    before = task.error.copy()
    if name != "rendezvous":
        assert np.allclose(before, error_twin(state, task), atol=1e-12)
    state.pos_w = state.pos_w + [1.0, -0.4]
    update(task, state, 4.4)
    assert np.allclose(task.error, before, atol=1e-12)


@pytest.mark.parametrize(("name", "options"), MOVING)
def test_the_plan_is_the_derivative_of_the_goals(name, options):
    state = rooms(2, 5, seed=1)
    task = begun(name, state, **options)
    lookahead = 0.0 if name == "gap" else 0.3
    dt, compared = 1e-5, 0
    for t in np.arange(0.0137, 12.0, 0.171):
        update(task, state, t)
        plan = task.plan.copy()
        goals = []
        for k in (-1.0, 0.0, 1.0):
            update(task, state, t + lookahead + k * dt)
            goals.append(task.goal_w.copy())
        before, after = (goals[1] - goals[0]) / dt, (goals[2] - goals[1]) / dt
        # Corners of routes and ends of paths have no derivative.
        smooth = np.linalg.norm(after - before, axis=-1) < 1e-3
        slope = 0.5 * (before + after)
        assert np.allclose(slope[smooth], plan[smooth], atol=1e-4)
        compared += smooth.mean()
    assert compared > 0.95 * len(np.arange(0.0137, 12.0, 0.171))


@pytest.mark.parametrize("name", TASKS)
def test_the_plan_knows_nothing_of_the_truth(name):
    state = rooms(2, 4, seed=2)
    task = begun(name, state)
    update(task, state, 3.0)
    # Goals relative to a car that drives by itself have no plan; policies do not observe goals.
    is_driven = isinstance(task, DrivingTask)
    known = [task.plan, task.target, *([] if is_driven else [task.goal_w])]
    kept = [a.copy() for a in known]
    other = rooms(2, 4, seed=9)
    update(task, other, 3.0)
    for before, after in zip(kept, known, strict=True):
        assert np.array_equal(before, after)


@pytest.mark.parametrize("name", TASKS)
def test_an_environment_of_a_batch_is_that_environment_alone(name):
    n_envs, n_cars = 4, 5
    together = make_task(name, n_cars, n_envs, ROOM)
    alone = [make_task(name, n_cars, 1, ROOM) for _ in range(n_envs)]
    for step, absent in enumerate((0.2, 0.2, 0.5, 0.0)):
        state = rooms(n_envs, n_cars, seed=7, absent=absent)
        state.pos_w = state.pos_w + 0.1 * step
        t = 1.7 * step + 0.3 * np.arange(n_envs)
        collided = np.arange(float(n_envs * n_cars)).reshape(n_envs, n_cars)
        if step == 0:
            together.reset(state, ALL)
        together.update(state, t, collided, ALL)
        for k, task in enumerate(alone):
            part = slice(k, k + 1)
            one = Rooms(*(getattr(state, f)[part] for f in Rooms.__dataclass_fields__))
            if step == 0:
                task.reset(one, ALL)
            task.update(one, t[part], collided[part], ALL)
            for key, array in arrays(together).items():
                assert np.array_equal(array[part], arrays(task)[key]), key


@pytest.mark.parametrize("name", TASKS)
def test_other_environments_are_left_alone(name):
    state = rooms(4, 3)
    task = begun(name, state)
    before = {key: array.copy() for key, array in arrays(task).items()}
    moved = rooms(4, 3, seed=8)
    task.reset(moved, slice(1, 3))
    task.update(moved, np.full(4, 9.0), np.ones((4, 3)), slice(1, 3))
    for key, array in arrays(task).items():
        assert np.array_equal(array[[0, 3]], before[key][[0, 3]])
    with pytest.raises(EnvError, match="envs"):
        task.update(moved, np.zeros(4), np.zeros((4, 3)), slice(0, 4, 2))


@given(
    name=st.sampled_from(list(TASKS)),
    n_cars=st.integers(2, 8),
    seed=st.integers(0, 10**6),
    absent=st.sampled_from([0.0, 0.4, 1.0]),
    t=st.floats(0.0, 1e5),
    fast=st.floats(0.0, 1e6),
)
@settings(max_examples=60)
def test_every_term_is_finite_and_within_its_bounds(name, n_cars, seed, absent, t, fast):
    state = rooms(2, n_cars, seed, absent)
    state.vel_w *= fast
    state.accel_w *= fast
    task = begun(name, state)
    collided = np.random.default_rng(seed).integers(0, 5, (2, n_cars)).astype(float)
    for now in (0.0, t, t + 0.1):
        update(task, state, now, collided)
        term = dict(zip(task.terms, np.moveaxis(task.rewards, -1, 0), strict=True))
        assert np.all((term["formation"] >= 0.0) & (term["formation"] <= 1.0))
        own = term[task.terms[1]]
        assert np.all((own >= -1.0) & (own <= 1.0))
        assert np.array_equal(term["collision"], np.where(state.present, -collided, 0.0))
        assert np.all((term["effort"] >= -1.0) & (term["effort"] <= 0.0))
        near, far = np.exp(-task.error / 0.5), np.exp(-task.error / 2.0)
        formation = 0.5 * (near + far) * state.present
        np.testing.assert_allclose(term["formation"], formation, atol=1e-12)
        short = np.maximum(1.0 - state.clearance / 0.15, 0.0)
        np.testing.assert_allclose(term["nearness"], -(short**2) * state.present, atol=1e-12)
        assert np.all(np.isin(term.get("time", 0.0), [-1.0, 0.0]))
        for array in arrays(task).values():
            assert np.isfinite(array).all()
