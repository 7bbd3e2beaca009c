"""Assignments that are repeated while cars drive, each computer by its own estimates."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from relpos_env.tasks import Reassignment, make_task

HERE = slice(0, 1)


def state_of(pos):
    pos = np.asarray(pos, dtype=float)[None]
    n = pos.shape[1]
    return SimpleNamespace(
        pos_w=pos, vel_w=np.zeros_like(pos), accel_w=np.zeros_like(pos),
        clearance=np.ones((1, n)), present=np.ones((1, n), dtype=bool),
    )  # fmt: skip


def begun(name, pos):
    made = partial(make_task, name, len(pos), 1, (12.0, 12.0))
    task = made()
    task.reset(state_of(pos), HERE)
    task.update(state_of(pos), np.zeros(1), np.zeros((1, len(pos))), HERE)
    return task, Reassignment(made)


def repeat(task, reassignment, pos):
    reassignment.repeat(task, state_of(pos), np.zeros(1), np.zeros((1, len(pos))))


def cost(task, pos):
    off = pos - task.goal_w[0]
    return np.square(off - off.mean(axis=0)).sum()


@pytest.mark.parametrize("name", ["hold", "escort"])
def test_the_best_assignment_replaces_a_worse_one_only(name):
    rng = np.random.default_rng(1)
    for _ in range(30):
        before, now = rng.uniform(-3.0, 3.0, (2, 5, 2))
        task, reassignment = begun(name, before)
        best, _ = begun(name, now)
        old = cost(task, now)
        repeat(task, reassignment, now)
        assert cost(task, now) <= old + 1e-9
        assert cost(task, now) <= cost(best, now) / 0.95 + 1e-9


def test_noise_does_not_change_it():
    pos = np.array([[0.0, 0.0], [1.0, 0.2], [0.2, 1.1], [-1.0, 0.5]])
    task, reassignment = begun("hold", pos)
    target = task.target.copy()
    rng = np.random.default_rng(0)
    for _ in range(50):
        repeat(task, reassignment, pos + rng.normal(0.0, 0.01, pos.shape))
    np.testing.assert_allclose(task.target, target, atol=1e-12)


def test_computers_that_estimate_differently_come_to_agree():
    """Cars move to the slots that their own computers give them, until they are in formation."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        pos = rng.uniform(-3.0, 3.0, (4, 2))
        computers = [begun("hold", pos + rng.normal(0.0, 0.3, pos.shape)) for _ in range(4)]
        for _ in range(80):
            for task, reassignment in computers:
                repeat(task, reassignment, pos + rng.normal(0.0, 0.1, pos.shape))
            steps = []
            for k, (task, _) in enumerate(computers):
                error = (pos - pos[k]) - task.target[0, k]
                steps.append(0.15 * error.sum(axis=0) / 3.0)
            pos = pos + steps
        error = [(pos - pos[k]) - task.target[0, k] for k, (task, _) in enumerate(computers)]
        assert np.linalg.norm(error, axis=-1).max() < 0.1
