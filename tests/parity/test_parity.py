"""Parity: estimates in the loop and those of the recorded log are equal bit for bit."""

from dataclasses import fields

import numpy as np
import pytest

from relpos_env import formation_v0
from relpos_env.interface.perception import FOR_POLICIES
from relpos_env.scenarios import draw_episode, scenario
from relpos_env.simulation.recorder import Recording
from relpos_env.simulation.scripted_driver import LoopDrivers
from relpos_env.timing import DT
from relpos_env.world.world import World
from tracking import TeamEstimate, Tracker, TrackerParams
from tracking.filters import FILTERS
from tracking.late_data.horizon import Horizon
from tracking.log import read_log, write_log


def assert_same_run(live: list[TeamEstimate], log: TeamEstimate) -> None:
    for f in fields(TeamEstimate)[1:]:
        stacked = np.stack([getattr(e, f.name)[0] for e in live])
        np.testing.assert_array_equal(stacked, getattr(log, f.name)[0], err_msg=f.name)


def copy(estimate: TeamEstimate) -> TeamEstimate:
    """Copy an estimate, which the next step of the loop overwrites."""
    arrays = (getattr(estimate, f.name).copy() for f in fields(TeamEstimate)[1:])
    return TeamEstimate(estimate.constellation, *arrays)


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("steps", [1, 7, 10, 43])
def test_simulator_is_replayed_log(tmp_path, name, steps):
    """Blocks of any number of physics steps give the same estimates."""
    place, rng = scenario("cars-nlos"), np.random.default_rng(5)
    swarm = World(place, place.n_cars, n_steps=steps)
    swarm.begin(0, draw_episode(place, place.n_cars, 12.0, rng), rng.spawn(1)[0])
    drivers, recording, params = LoopDrivers(place, rng), Recording(), TrackerParams()
    horizon = Horizon(params.horizon)
    tracker = Tracker(swarm.constellation, params, filter=name)
    live, t = [], 0.0
    while swarm.t[0] < 12.0:
        if swarm.t[0] >= t:
            command, t = drivers.command(swarm.state.take(0)), t + 10 * DT
        due = horizon.step(swarm.step(command.speed[None], command.steering[None]), swarm.t)
        recording.add_swarm(swarm)
        live.append(tracker.step(due, horizon.t))
    recorded = recording.to_log("run", place.name, swarm.constellation, truth_every=2)
    log = read_log(write_log(tmp_path / "run", recorded))
    t_out = np.array([e.t[0] for e in live])
    replayed = Tracker(log.constellation, params, filter=name).run(log.block, t_out)
    assert_same_run(live, replayed)


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize(
    "arguments",
    [{}, {"scenario": "random", "task": "travel"}, {"scenario": "hall", "n_cars": 5}],
    ids=lambda each: each.get("scenario", "ring-nlos"),
)
def test_environment_is_replayed_log(tmp_path, arguments, name):
    """The comparison starts when the trackers are switched on; cars come, go and lose power."""
    env = formation_v0.parallel_env(max_cycles=150, record=True, filter=name, **arguments)
    for seed in (3, 11):  # the first episode must leave no trace
        env.reset(seed=seed)
        rng = np.random.default_rng(0)
        live = [copy(env.loop.estimate)]
        while env.agents:
            env.step({a: rng.uniform(-1, 1, 2).astype(np.float32) for a in env.agents})
            live.append(copy(env.loop.estimate))
    log = read_log(write_log(tmp_path / "run", env.recorded_log("run")))
    t_out = np.array([e.t[0] for e in live])
    params = TrackerParams(filter=FOR_POLICIES)
    assert_same_run(live, Tracker(log.constellation, params, filter=name).run(log.block, t_out))


def test_a_recording_begins_with_the_episode():
    env = formation_v0.parallel_env(max_cycles=5, record=True)
    env.reset(seed=0)
    log = env.recorded_log("run")
    assert log.truth.times()[0] == pytest.approx(2 * DT)
    assert log.truth.times()[-1] == pytest.approx(env.loop.swarm.t[0])
