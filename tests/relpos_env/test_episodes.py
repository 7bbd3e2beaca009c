"""Randomisation of episodes: properties, independence, levels."""

from dataclasses import fields, replace

import numpy as np
import pytest

from relpos_env.errors import EnvError
from relpos_env.scenarios import (
    LEVELS,
    SCENARIOS,
    Randomisation,
    draw_episode,
)
from relpos_env.scenarios.cars import CARS_LOS
from relpos_env.scenarios.rooms.floor import Floor
from relpos_env.scenarios.rooms.obstacle import boxes_of
from relpos_env.scenarios.rooms.overlap import beyond_walls, car_boxes, overlap

SLOTS = 8
SECONDS = 180.0


def rng(seed=0):
    return np.random.default_rng(seed)


def draw(chosen, seed=0, slots=SLOTS):
    return draw_episode(chosen, slots, SECONDS, rng(seed))


def content(episode):
    """Return the contents of an episode, to compare by kinds of draws."""
    return {
        f.name: value.tolist() if isinstance(value, np.ndarray) else value
        for f in fields(episode)
        for value in [getattr(episode, f.name)]
    }


ALL = [(name, level) for name in SCENARIOS for level in (None, 0, 2, 4)]


@pytest.mark.parametrize(("name", "level"), ALL)
def test_laws_of_episodes(name, level):
    s = SCENARIOS[name] if level is None else SCENARIOS[name].at_level(level)
    for seed in range(4):
        e = draw(s, seed)
        assert content(e) == content(draw(s, seed))
        walls, cars = boxes_of(e.obstacles), car_boxes(e.start[e.present], e.car, 0.01)
        assert overlap(cars, cars).sum() == len(cars) >= 2
        assert not overlap(cars, walls).any()
        assert not beyond_walls(cars, s.room).any()
        drawn = walls[len(s.obstacles) :]
        assert not beyond_walls(drawn, s.room).any()
        assert overlap(drawn, walls).sum() == len(drawn)
        floors = [Floor(s.room, s.car, w) for w in (boxes_of(s.obstacles), walls)]
        before, after = (f.patches(f.clearance)[0] for f in floors)
        assert after <= before
        check_life(s, e)


def check_life(s, e):
    present, powered = e.present.copy(), np.ones(SLOTS, dtype=bool)
    assert [v.t for v in e.events] == sorted(v.t for v in e.events)
    for v in e.events:
        assert 2.0 < v.t < SECONDS
        if v.what == "join":
            assert not present[v.car]
            present[v.car] = powered[v.car] = True
            car = car_boxes(np.array([v.pose]), e.car)
            assert not overlap(car, boxes_of(e.obstacles)).any()
            assert not beyond_walls(car, s.room).any()
            assert not overlap(car, car_boxes(e.start[e.present], e.car)).any()
        else:
            assert present[v.car]
            assert powered[v.car] == (v.what == "power-off") or v.what == "leave"
            present[v.car] = v.what != "leave"
            powered[v.car] = v.what == "power-on"
        assert present.sum() >= 2


@pytest.mark.parametrize("name", ["cars-nlos", "ring-los", "hall", "gap"])
def test_without_randomisation_an_episode_is_the_scenario(name):
    s = SCENARIOS[name]
    e = draw(s, 5)
    np.testing.assert_array_equal(e.start[: s.n_cars], s.start(rng(5)))
    assert (e.obstacles, e.events) == (s.obstacles, ())
    assert e.present.tolist() == [k < s.n_cars for k in range(SLOTS)]
    assert (e.car, e.imu, e.mag, e.odometer, e.radio) == (s.car, s.imu, s.mag, s.odometer, s.radio)


KINDS = {
    "obstacles": {"obstacles": (3, 3)},
    "start": {"n_cars": (4, 6)},
    "imu": {"imu_noise": (0.5, 2.0), "imu_bias": (0.5, 2.0), "imu_vibration": (0.5, 2.0)},
    "mag": {"mag_disturbance": (0.5, 2.0), "mag_hard_iron": (0.5, 2.0)},
    "odometer": {"odometer_scale": (0.5, 2.0)},
    "radio": {"radio_loss": (2.0, 5.0), "range_noise": (0.5, 2.0), "antenna_delay": (0.1, 0.2)},
    "car": {"friction": (0.5, 0.9), "mass": (1.1, 1.5)},
    "events": {"leave_rate": (3.0, 3.0), "power_off_rate": (3.0, 3.0)},
}
ON = Randomisation(**{key: value for kind in KINDS.values() for key, value in kind.items()})


@pytest.mark.parametrize("layout", ["ring", "scattered"])
@pytest.mark.parametrize("kind", KINDS)
def test_one_kind_of_randomisation_leaves_the_draws_of_the_others(kind, layout):
    place = replace(CARS_LOS, layout=layout)
    without = {name: getattr(Randomisation(), name) for name in KINDS[kind]}
    for off in (Randomisation(), replace(ON, **without)):
        on = replace(off, **KINDS[kind])
        a, b = (content(draw(replace(place, randomisation=what), 3)) for what in (off, on))
        assert a[kind] != b[kind]
        # Scattered and joining cars depend on the free floor.
        follows = {"start": {"present", "events"}, "obstacles": {"events"}}.get(kind, set())
        if (kind, layout) == ("obstacles", "scattered"):
            follows.add("start")
        for other in a.keys() - follows - {kind}:
            assert a[other] == b[other], other
        if kind == "obstacles":
            happened = [[(v.t, v.car, v.what) for v in e["events"]] for e in (a, b)]
            assert happened[0] == happened[1]


def test_factors_stay_in_their_intervals_and_spread():
    what = Randomisation(imu_noise=(0.5, 2.0), antenna_delay=(0.1, 0.2), radio_loss=(1.0, 1e2))
    s = replace(CARS_LOS, randomisation=what)
    drawn = [draw(s, k) for k in range(200)]
    noise = np.array([e.imu.acc_noise / s.imu.acc_noise for e in drawn])
    assert 0.5 <= noise.min() < 0.55
    assert 1.8 < noise.max() <= 2.0
    assert abs(np.log(noise).mean()) < 0.1  # a half is as frequent as a double
    assert all(0.1 <= e.radio.antenna_delay_std <= 0.2 for e in drawn)
    assert all(s.radio.channel.loss <= e.radio.channel.loss <= 0.9 for e in drawn)


def test_cars_leave_and_trackers_fail_as_often_as_asked():
    what = Randomisation(leave_rate=(6.0, 6.0), power_off_rate=(3.0, 3.0), absence=(1.0, 2.0))
    s = replace(SCENARIOS["open"], randomisation=what)
    happened = [v.what for k in range(50) for v in draw(s, k).events]
    minutes = 50 * (SECONDS - 2.0) / 60.0
    for kind, rate in (("leave", 6.0), ("join", 6.0), ("power-off", 3.0)):
        assert happened.count(kind) == pytest.approx(rate * minutes, rel=0.12)


def test_the_numbers_of_cars_all_occur():
    s = SCENARIOS["cars-los"].at_level(4)
    assert {int(draw(s, k).present.sum()) for k in range(60)} == set(range(2, 9))
    assert {int(draw(s, k, slots=3).present.sum()) for k in range(20)} == {2, 3}


def test_levels_have_names():
    s = SCENARIOS["hall"]
    for number, name in enumerate(("easy", "medium", "hard", "expert"), 1):
        assert s.at_level(name) == s.at_level(number)
    assert s.at_level(np.int64(3)) == s.at_level("hard")


def test_levels_have_more_and_more():
    assert LEVELS[0] == Randomisation()
    off = Randomisation()
    on = [{f.name for f in fields(w) if getattr(w, f.name) != getattr(off, f.name)} for w in LEVELS]
    assert all(a < b for a, b in zip(on, on[1:], strict=False))
    small = replace(CARS_LOS, n_cars_range=(2, 4)).at_level(4)
    assert small.randomisation.n_cars == (2, 4)
    with pytest.raises(EnvError, match="level: expected 0 to 4 or one of easy, .*, got 5"):
        CARS_LOS.at_level(5)


def test_too_few_slots_are_named():
    with pytest.raises(EnvError, match="n_slots: expected at least 3"):
        draw_episode(CARS_LOS, 2, 60.0, rng())
    with pytest.raises(EnvError, match="n_slots: expected 2 to 20"):
        draw_episode(CARS_LOS, 21, 60.0, rng())
    with pytest.raises(EnvError, match="seconds: expected above 0"):
        draw_episode(CARS_LOS, 3, 0.0, rng())
