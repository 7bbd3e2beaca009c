"""One tracker: the estimates in the loop and those of the recorded log are the same bits."""

from dataclasses import fields

import numpy as np
import pytest

from relpos_env import formation_v0
from relpos_env.drivers import LoopDrivers
from relpos_env.scenarios import scenario
from relpos_env.sim import Simulation
from tracking import TeamEstimate, Tracker, TrackerParams
from tracking.filters import FILTERS
from tracking.horizon import Horizon
from tracking.log import read_log, write_log


def assert_same_run(live: list[TeamEstimate], log: TeamEstimate) -> None:
    for f in fields(TeamEstimate)[1:]:
        stacked = np.stack([getattr(e, f.name)[0] for e in live])
        np.testing.assert_array_equal(stacked, getattr(log, f.name)[0], err_msg=f.name)


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("steps", [1, 7, 10, 43])
def test_simulator_is_replayed_log(tmp_path, name, steps):
    """However many steps of the physics make a block."""
    sim = Simulation(scenario("cars-nlos"), np.random.default_rng(5), record=True)
    drivers = LoopDrivers(sim.scenario, sim.driver_rng)
    params = TrackerParams()
    horizon = Horizon(params.horizon)
    tracker = Tracker(sim.constellation, params, filter=name)
    live, command = [], drivers.command(sim.state)
    for k in range(0, 1200, steps):
        if k % 10 == 0:
            command = drivers.command(sim.state)
        due = horizon.step(sim.step(command, steps), sim.t)
        live.append(tracker.step(due, horizon.t))
    log = read_log(write_log(tmp_path / "run", sim.to_log("run")))
    t_out = np.array([e.t[0] for e in live])
    replayed = Tracker(log.constellation, params, filter=name).run(log.block, t_out)
    assert_same_run(live, replayed)


def test_environment_is_replayed_log(tmp_path):
    env = formation_v0.parallel_env(max_cycles=150, record=True)
    env.reset(seed=11)
    rng = np.random.default_rng(0)
    live = [env.loop.estimate]
    while env.agents:
        env.step({a: rng.uniform(-1, 1, 2).astype(np.float32) for a in env.agents})
        live.append(env.loop.estimate)
    log = read_log(write_log(tmp_path / "run", env.recorded_log("run")))
    t_out = np.array([e.t[0] for e in live])
    assert_same_run(live, Tracker(log.constellation).run(log.block, t_out))
