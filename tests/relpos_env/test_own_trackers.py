"""Trackers on each car: the same results in every form, and errors near those of one tracker."""

import pickle

import numpy as np
import pytest

from relpos_env import formation_v0
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.errors import EnvError
from relpos_env.scenarios import scenario
from relpos_env.simulation.scripted_driver import LoopDrivers

OWN = {"scenario": "cars-nlos", "trackers": "own", "max_cycles": 400}


def core_of(n_envs, threads=1, **arguments):
    core = EnvCore(configure({**OWN, **arguments}), n_envs, threads)
    for env in range(n_envs):
        core.seed(env, np.random.default_rng(40 + env))
    core.begin(range(n_envs))
    return core


def actions(n_envs, n, k):
    phase = np.arange(n_envs)[:, None] + 2.0 * np.arange(n)
    return 0.8 + 0.4 * np.sin(0.3 * k + phase), 0.3 * np.sin(0.2 * k + phase)


def run(core, first, steps):
    seen = []
    for k in range(first, first + steps):
        core.step(*actions(core.n_envs, core.parts.n_cars, k))
        seen.append((core.observations.copy(), core.loop.view.cov.copy()))
    return seen


def equal(a, b, envs=slice(None)):
    return all(
        np.array_equal(x, y[envs]) for one, two in zip(a, b, strict=True)
        for x, y in zip(one, two, strict=True)
    )  # fmt: skip


def test_an_environment_of_a_batch_is_that_environment_alone():
    batch = run(core_of(3), 0, 30)
    alone = core_of(1)
    seen = []
    for k in range(30):
        speed, steering = actions(3, 3, k)
        alone.step(speed[:1], steering[:1])
        seen.append((alone.observations.copy(), alone.loop.view.cov.copy()))
    assert equal(seen, batch, slice(0, 1))


def test_threads_and_copies_change_nothing():
    whole = run(core_of(4), 0, 25)
    assert equal(run(core_of(4, threads=2), 0, 25), whole)
    core = core_of(4)
    run(core, 0, 10)
    copy = pickle.loads(pickle.dumps(core))
    assert equal(run(copy, 10, 15), whole[10:])


def test_a_reset_forgets_everything_of_its_environment_and_nothing_of_the_others():
    core, other = core_of(2), core_of(2)
    run(core, 0, 10), run(other, 0, 10)
    other.seed(0, np.random.default_rng(40))
    other.begin([0])
    a, b, fresh = run(core, 10, 10), run(other, 10, 10), run(core_of(2), 10, 10)
    assert all(np.array_equal(x[0][1], y[0][1]) for x, y in zip(a, b, strict=True))
    assert all(np.array_equal(x[0][0], y[0][0]) for x, y in zip(b, fresh, strict=True))


def test_a_car_that_was_off_knows_nothing_of_before():
    """Its tracker begins again, and the others do not continue its sums."""
    core = core_of(1)
    run(core, 0, 20)
    assert core.loop.view.ok[0, 0, 1:].all()
    world, epoch = core.loop.swarm, int(core.loop.perception._own._senders["epoch"][0, 0])
    world.powered[0, 0] = False
    world._radio.switch_off(0, 0)
    run(core, 20, 2)
    assert not core.loop.view.ok[0, 0].any()
    world.powered[0, 0] = True
    world._radio.switch_on(0, 0, boot=9)
    run(core, 22, 1)
    assert not core.loop.view.ok[0, 0].any()
    run(core, 23, 1)
    assert int(core.loop.perception._own._senders["epoch"][0, 0]) == epoch + 1
    driver = LoopDrivers(scenario("cars-nlos"), np.random.default_rng(0), 3)
    for _ in range(120):
        command = driver.command(core.state.take(0))
        core.step(command.speed[None], command.steering[None])
    assert core.loop.view.ok[0, 0, 1:].all()


def test_estimates_of_each_car_are_its_own():
    core = core_of(2)
    run(core, 0, 60)
    view = core.loop.view
    both = view.ok & view.ok.transpose(0, 2, 1)
    assert both.any()
    gap = np.linalg.norm(view.pos + view.pos.transpose(0, 2, 1, 3), axis=-1)[both]
    assert 0.0 < np.median(gap) < 0.3
    found = core.infos()["disagreement"]
    assert 0.0 < np.median(found[np.isfinite(found)]) < 0.3


def test_one_tracker_does_not_disagree_with_itself():
    core = core_of(2, trackers="group")
    run(core, 0, 40)
    found = core.infos()["disagreement"]
    assert np.all(found[np.isfinite(found)] == 0.0)


def errors(trackers, n_envs=6, steps=300):
    """Return the median RMS error of a car, the share ok, and ok and wrong by half a metre.

    The median: a car whose radio loses the group for a second has no motion of the others.
    """
    core, world = core_of(n_envs, trackers=trackers), scenario("cars-nlos")
    drivers = [LoopDrivers(world, np.random.default_rng(k), 3) for k in range(n_envs)]
    off, ok, other = [], [], ~np.eye(3, dtype=bool)
    for k in range(steps):
        commands = [d.command(core.state.take(e)) for e, d in enumerate(drivers)]
        core.step(np.stack([c.speed for c in commands]), np.stack([c.steering for c in commands]))
        if k >= 60:
            pos = core.state.pos_w
            true = pos[:, None] - pos[:, :, None]
            off.append(np.linalg.norm(core.loop.view.pos - true, axis=-1)[:, other].reshape(-1, 2))
            ok.append(core.loop.view.ok[:, other].reshape(-1, 2))
    off, ok = np.stack(off), np.stack(ok)
    of_car = np.sqrt((off**2).mean(axis=(0, 2)))
    return np.median(of_car), ok.mean(), (ok & (off > 0.5)).mean()


def test_own_trackers_are_nearly_as_good_as_one_for_the_group():
    own, group = errors("own"), errors("group")
    assert own[0] < 1.25 * group[0]
    assert own[1] > group[1] - 0.05
    assert own[2] < 0.01


def test_the_forms_take_the_argument():
    env = formation_v0.parallel_env(scenario="open", n_cars=2, trackers="own", max_cycles=5)
    env.reset(seed=1)
    while env.agents:
        _, _, _, _, infos = env.step({a: env.action_space(a).sample() for a in env.agents})
    assert all("disagreement" in info for info in infos.values())
    with pytest.raises(EnvError, match="trackers: expected group or own"):
        formation_v0.parallel_env(trackers="both")
