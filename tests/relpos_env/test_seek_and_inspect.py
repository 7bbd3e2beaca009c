"""Tasks that end in a place or a picture: a transponder that only ranges, walls to be seen."""

import pickle

import numpy as np
import pytest

from relpos_env import formation_v0
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.errors import EnvError
from relpos_env.tasks import DrivingTask, make_task
from relpos_env.tasks.inspect import wall_points
from relpos_env.tasks.rendezvous import Rendezvous
from tracking.measurements import Kind

CURVE = np.array([0.4, 0.5], np.float32)
PILLAR = np.array([[1.0, 0.5, 0.3, 0.2, 0.8, 0.6]])


def run(env, n, seed=0, action=CURVE):
    env.reset(seed=seed)
    for _ in range(n):
        yield env.step({agent: action for agent in env.agents})


@pytest.mark.parametrize("trackers", ["group", "own"])
def test_of_the_transponder_nothing_but_ranges_is_known(trackers):
    env = formation_v0.parallel_env(task="seek", n_cars=3, trackers=trackers, max_cycles=40)
    samples, ranges = set(), 0
    for _ in run(env, 40):
        block = env.formation.loop.swarm.block
        kinds = block.kind[0, block.valid[0]]
        is_sample = (kinds == Kind.IMU) | (kinds == Kind.MAG)
        samples |= set(block.i[0, block.valid[0]][is_sample].tolist())
        ranges += (block.i[0, block.valid[0]][kinds == Kind.RANGE] == 0).sum()
    assert samples == {1, 2}
    assert ranges > 100
    assert not env.formation.loop.view.oriented[0, 0]


@pytest.mark.parametrize("task", ["seek", "inspect"])
def test_threads_and_copies_give_the_same(task):
    """Cars come and go in this scenario."""
    cores = []
    for threads in (1, 2):
        parts = configure({"task": task, "scenario": "swarm-nlos", "max_cycles": 60})
        core = EnvCore(parts, 4, threads)
        for env in range(4):
            core.seed(env, np.random.default_rng(env))
        core.begin(range(4))
        cores.append(core)
    rng = np.random.default_rng(0)
    for step in range(60):
        if step == 30:
            cores.append(pickle.loads(pickle.dumps(cores[0])))
        speed, steering = rng.uniform(-1.0, 1.0, (2, 4, cores[0].parts.n_cars))
        for core in cores:
            core.step(speed, 0.4 * steering)
    for core in cores[1:]:
        np.testing.assert_array_equal(core.observations, cores[0].observations)
        np.testing.assert_array_equal(core.rewards, cores[0].rewards)
        core.close()


def test_a_task_of_ones_own_that_drives_needs_no_more():
    class Mine(DrivingTask, Rendezvous):
        def plan_drive(self, env, rng):
            pass

        def drive(self, state, t, speed, steering):
            speed[:, 0] = 0.5

    env = formation_v0.parallel_env(task=Mine, scenario="open", n_cars=2, max_cycles=10)
    *_, _ = run(env, 10)
    assert env.formation.loop.has_samples.all()


def test_a_recording_has_no_samples_of_the_transponder():
    env = formation_v0.parallel_env(task="seek", n_cars=4, max_cycles=50, record=True)
    *_, _ = run(env, 50)
    log = env.recorded_log("seek")
    assert log.block.valid.all()
    kinds = log.block.kind[0]
    assert set(log.block.i[0, kinds == Kind.IMU].tolist()) == {1, 2, 3}
    assert len(log.nlos) == (kinds == Kind.RANGE).sum()


def test_it_is_found_all_the_same():
    env = formation_v0.parallel_env(task="seek", n_cars=5, scenario="hall", max_cycles=200)
    found = []
    for _ in run(env, 200, seed=1):
        view, pos = env.formation.loop.view, env.formation.state.pos_w[0]
        off = np.linalg.norm(view.pos[0, 1:, 0] - (pos[0] - pos[1:]), axis=1)
        found.append(np.where(view.ok[0, 1:, 0], off, np.inf))
    assert np.median(found[100:]) < 0.3


def test_points_are_in_front_of_walls_and_in_no_box():
    half = np.array([3.0, 2.0])
    boxes = np.concatenate([PILLAR, [[2.7, 1.7, 0.5, 0.5, 1.0, 0.0]]])  # the second is in a corner
    points = wall_points(half, boxes)
    assert (np.abs(points) < half).all()
    for x, y, w, h, c, s in boxes:
        own = (points - [x, y]) @ np.array([[c, -s], [s, c]])
        assert not (np.abs(own) < [w, h]).all(axis=1).any()
    # As many as the length of the walls tells: 20 m of the room, 2 m of the pillar, 2 x 0.8 m less.
    assert len(points) * 0.25 == pytest.approx(20.0 + 2.0 - 1.6 + 1.6, abs=0.8)


def task_at(places, ok=True, boxes=PILLAR, **options):
    """Return a task after one look at the walls from some places."""
    n = len(places)
    env = formation_v0.parallel_env(task="inspect", n_cars=n, scenario="hall", max_cycles=5)
    env.reset(seed=0)
    state = env.formation.state
    state.pos_w[0] = places
    state.present[:] = True
    task = make_task("inspect", n, 1, (6.0, 4.0), half_axes=(2.0, 1.0), **options)
    here = slice(0, 1)
    task.reset(state, here, boxes[None])
    task.update(state, np.zeros(1), np.zeros((1, n)), here)
    usable = np.broadcast_to(ok, (1, n, n)) & ~np.eye(n, dtype=bool)
    task.inform(np.zeros((1, n, n, 3)), usable, here)
    return task


def test_what_is_seen_is_in_reach_and_in_sight():
    """A twin that samples the line of sight finely instead of clipping it."""
    places = np.array([[0.2, 0.1], [-2.0, 1.0]])
    task = task_at(places, reach=2.2)
    points = wall_points(np.array([3.0, 2.0]), PILLAR)
    x, y, w, h, c, s = PILLAR[0]
    expected = np.zeros(len(points), dtype=bool)
    for place in places:
        line = place + np.linspace(0.0, 1.0, 2001)[:, None, None] * (points - place)
        own = (line - [x, y]) @ np.array([[c, -s], [s, c]])
        hidden = (np.abs(own) < [w, h]).all(axis=2).any(axis=0)
        expected |= ~hidden & (np.linalg.norm(points - place, axis=1) <= 2.2)
    assert 0.3 < task.coverage[0] < 0.9
    assert task.coverage[0] == pytest.approx(expected.mean(), abs=0.011)
    assert task.coverage[0] == pytest.approx(task.rewards[0, :, -1].sum())


def test_a_car_that_does_not_know_where_it_is_sees_nothing():
    assert task_at([[0.0, 0.0], [1.0, -1.0]], ok=False).coverage[0] == 0.0
    first_only = np.array([[[False, True], [False, False]]])
    task = task_at([[0.0, 0.0], [1.0, -1.0]], ok=first_only)
    assert task.rewards[0, 0, -1] > 0.0
    assert task.rewards[0, 1, -1] == 0.0


def test_it_is_done_once_enough_is_seen():
    everywhere = np.array([[x, y] for x in (-2.0, 0.0, 2.0) for y in (-1.0, 1.0)])
    assert task_at(everywhere).done[0]
    task = task_at(everywhere[:2])
    assert not task.done[0]
    assert (task.rewards[0, :, -2] == -1.0).all()
    assert task_at(everywhere[:2], enough=0.3).done[0]


def test_an_episode_starts_with_walls_unseen():
    env = formation_v0.parallel_env(task="inspect", scenario="ring-nlos", max_cycles=60)
    for seed in (1, 2):
        coverage = [env.formation.task.coverage[0] for _ in run(env, 60, seed=seed)]
        assert coverage[0] < 0.01 < 0.3 < coverage[-1]


@pytest.mark.parametrize("options", [{"enough": 1.5}, {"enough": 0.0}, {"reach": -1.0}])
def test_options_out_of_range_are_named(options):
    with pytest.raises(EnvError, match=f"^{next(iter(options))}: expected"):
        make_task("inspect", 3, 1, (8.0, 8.0), **options)
