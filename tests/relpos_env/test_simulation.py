"""Recorded rooms: ranges with the errors of the place, and independent random streams."""

from dataclasses import replace

import numpy as np
import pytest
from runs import bits

from relpos_env.errors import EnvError
from relpos_env.scenarios import SCENARIOS, draw_episode, scenario
from relpos_env.sensors import RadioSimParams
from relpos_env.sensors.radio.channel import EXACT
from relpos_env.simulation.scripted_driver import LoopDrivers
from relpos_env.simulation.simulation import Simulation
from relpos_env.world.world import World
from tracking.measurements import Kind


def ranges(sim_scenario, seconds=20.0, seed=2):
    sim = Simulation(sim_scenario, np.random.default_rng(seed))
    drivers = LoopDrivers(sim_scenario, sim.driver_rng)
    for _ in range(round(seconds * 10)):
        sim.step(drivers.command(sim.state))
    return sim.to_log("x")


def errors(log):
    chosen = log.block.kind[0] == Kind.RANGE
    t = log.block.t[0, chosen]
    pos, known = log.truth.positions(log.constellation, t)
    rows = np.arange(len(t))
    i, j = log.block.i[0, chosen], log.block.j[0, chosen]
    true = np.linalg.norm(pos[rows, j] - pos[rows, i], axis=1)
    ok = known[rows, i] & known[rows, j]
    return (log.block.values[0, chosen, 0] - true)[ok], log.nlos[ok], np.stack([i, j])[:, ok]


def test_ranges_come_at_the_rate_of_the_protocol_with_the_errors_of_the_place():
    e, nlos, _ = errors(ranges(scenario("cars-nlos"), seconds=60.0))
    assert 0.05 < nlos.mean() < 0.6
    # Errors are correlated over metres, so that a minute has few independent ones.
    assert e[~nlos].std() == pytest.approx(0.06, rel=0.3)
    assert e[~nlos].mean() == pytest.approx(0.0, abs=0.04)
    assert 0.03 < e[nlos].mean() < 0.25
    exact = ranges(replace(scenario("cars-los"), radio=RadioSimParams(channel=EXACT)))
    rounds = exact.n_ranges / 3 / (20.0 - exact.t_range[0])
    assert rounds == pytest.approx(80.6, rel=0.01)
    assert np.abs(errors(exact)[0]).max() < 0.008


def test_recordings_to_calibrate_with_have_the_sum_of_both_antennas_in_every_range():
    delays = replace(RadioSimParams(channel=EXACT), antenna_delay_std=0.2)
    e, _, ends = errors(ranges(replace(scenario("cars-los"), radio=delays)))
    pairs = [e[(ends[0] == i) & (ends[1] == j)] for i, j in ((0, 1), (0, 2), (1, 2))]
    assert all(np.ptp(values) < 0.02 for values in pairs)
    assert max(abs(values.mean()) for values in pairs) > 0.05


def test_more_cars_than_a_short_frame_has_rows_for():
    big = {"name": "big", "room": (30.0, 30.0), "ring": (8.0, 8.0), "n_cars": 18}
    log = ranges(replace(scenario("ring-los"), **big), seconds=6.0)
    heard = {(int(i), int(j)) for i, j in zip(log.block.i[0], log.block.j[0], strict=True)}
    assert sum(i != j for i, j in heard) == 18 * 17 / 2


@pytest.mark.parametrize("name", ["cars-nlos", "hall"])
def test_same_seed_same_recording(name):
    a, b = (ranges(scenario(name), seconds=3.0, seed=9) for _ in range(2))
    assert bits(a.block.values) == bits(b.block.values)
    assert bits(a.truth.pos_w) == bits(b.truth.pos_w)
    other = ranges(scenario(name), seconds=3.0, seed=10)
    assert not np.array_equal(a.truth.pos_w, other.truth.pos_w)


@pytest.mark.parametrize("name", ["warehouse", "open"])
def test_as_many_cars_as_a_scenario_asks_for_can_be_recorded(name):
    log = ranges(SCENARIOS[name], seconds=2.0)
    assert len(set(log.block.i[0])) == SCENARIOS[name].n_cars


def streams(seed=3, **change):
    """Return the data of each kind of sensor with changed parameters of the episode."""
    place = scenario("cars-nlos")
    swarm = World(place, 3)
    rng = np.random.default_rng(seed)
    episode = draw_episode(place, 3, 10.0, rng)
    changed = {k: replace(getattr(episode, k), **v) for k, v in change.items()}
    swarm.begin(0, replace(episode, **changed), rng)
    kinds = {Kind.IMU: [], Kind.MAG: [], Kind.RANGE: []}
    wheels = []
    for _ in range(20):
        block = swarm.step(np.full((1, 3), 0.5), np.full((1, 3), 0.1))
        for kind, rows in kinds.items():
            chosen = block.valid[0] & (block.kind[0] == kind)
            rows.append(bits((block.t[0, chosen], block.i[0, chosen], block.values[0, chosen])))
        wheels.append(bits(swarm.odometer))
    names = {Kind.IMU: "imu", Kind.MAG: "mag", Kind.RANGE: "radio"}
    return {**{names[k]: v for k, v in kinds.items()}, "odometer": wheels}


CHANGES = {
    "imu": {"acc_noise": 0.5, "gyr_bias": 0.1},
    "mag": {"noise": 3.0, "hard_iron": 2.0, "disturbance": 9.0},
    "odometer": {"noise": 0.5, "scale_std": 0.3},
    "radio": {"channel": EXACT, "antenna_delay_std": 0.3},
}


@pytest.mark.parametrize("kind", CHANGES)
def test_errors_of_one_sensor_change_no_other(kind):
    plain, changed = streams(), streams(**{kind: CHANGES[kind]})
    assert {name for name, stream in plain.items() if stream != changed[name]} == {kind}


def test_impossible_numbers_of_cars():
    with pytest.raises(EnvError, match="cars: expected at least 2|n_cars: expected 2"):
        replace(scenario("cars-los"), n_cars=1)
    with pytest.raises(EnvError, match="cars: 50 do not fit|n_cars: expected"):
        replace(scenario("cars-los"), n_cars=50)
