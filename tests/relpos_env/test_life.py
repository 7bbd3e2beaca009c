"""Cars that join, leave and return, trackers without power: effects on the agents."""

from dataclasses import replace

import numpy as np
import pytest

from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.core import env_core as formation
from relpos_env.formation_v0 import parallel_env
from relpos_env.interface.observations import index_table
from relpos_env.scenarios import draw_episode
from relpos_env.scenarios.life import LifeEvent
from relpos_env.timing import STAND_STILL
from tracking import Status

NEW, RETURNS, LEAVES, DARK = 3, 1, 2, 0
"""Cars by their events."""
COME_AND_GO = (
    (2.0, NEW, "join"),
    (3.0, RETURNS, "leave"),
    (4.5, LEAVES, "leave"),
    (6.0, RETURNS, "join"),
)
"""Events by seconds since the end of the initial rest."""
JOIN = ((8.0, NEW, "join"),)
OUTAGE = ((8.0, DARK, "power-off"), (20.0, DARK, "power-on"))


def first_cycle(t):
    """Return the first step that shows an event: the one that starts at its time or after."""
    return int(np.ceil(round(10 * t, 6))) + 1


@pytest.fixture
def life(monkeypatch, request):
    """Use episodes with exactly these events; cars join where they would have started."""
    happens = getattr(request, "param", COME_AND_GO)

    def draw(scenario, n_slots, seconds, rng):
        episode = draw_episode(scenario, n_slots, seconds, rng)
        events = []
        present = episode.present.copy()
        for t, car, what in happens:
            pose = tuple(episode.start[car]) if what == "join" else None
            events.append(LifeEvent(t=STAND_STILL + t, car=car, what=what, pose=pose))
            present[car] &= not (car == NEW and what == "join")
        return replace(episode, present=present, events=tuple(events))

    monkeypatch.setattr(formation, "draw_episode", draw)


def make(form=parallel_env, **kwargs):
    options = {"scenario": "hall", "n_cars": 4, "max_cycles": 260, **kwargs}
    return form(**options)


def circling(env, k):
    """Drive every car on a circle of its own at varying speed; none touches another."""
    speed = 0.4 + 0.1 * np.sin(0.1 * k * (1.0 + 0.2 * np.arange(4)))
    rows = np.stack([speed, np.full(4, 0.7)], axis=-1).astype(np.float32)
    return {a: rows[int(a[-1])] for a in env.agents}


def trace(env, seed=0):
    """Return the results of every step of an episode, the reset first."""
    observations, infos = env.reset(seed=seed)
    rows = [(list(env.agents), observations, {}, {}, {}, infos)]
    while env.agents:
        step = env.step(circling(env, len(rows)))
        rows.append((list(env.agents), *step))
    return rows


def test_who_is_an_agent_when(life):
    env = make()
    rows = trace(env)
    names = env.possible_agents
    joins, gone = first_cycle(2.0), first_cycle(4.5)
    for cycle, (agents, observations, *results, infos) in enumerate(rows[:-1]):
        expected = {names[DARK], names[RETURNS]}
        expected |= {names[NEW]} if cycle >= joins else set()
        expected |= {names[LEAVES]} if cycle < gone else set()
        assert set(agents) == expected
        concerned = expected | ({names[LEAVES]} if cycle == gone else set())
        assert set(observations) == set(infos) == concerned
        for result in results[: 3 if cycle else 0]:
            assert set(result) == concerned
    truncated = [row[4].get(names[LEAVES]) for row in rows[1:]]
    assert truncated[gone - 2 : gone + 1] == [False, True, None]
    assert not any(any(row[3].values()) for row in rows)
    assert all(rows[-1][4].values())
    assert not env.agents


def test_cars_that_are_away_see_zeros_and_earn_nothing(life):
    rows = trace(make(history=3))
    gone, back = first_cycle(3.0), first_cycle(6.0)
    for cycle, (_, observations, rewards, *_, infos) in enumerate(rows):
        away = gone <= cycle < back
        assert infos["car_1"]["present"] == (not away)
        assert observations["car_1"].any() != away
        if cycle:
            assert (rewards["car_1"] == 0.0) == away


def test_what_absent_cars_do_has_no_effect(life):
    """This includes the step in which they return."""
    runs = []
    for action in (0.0, 1.0):
        env = make(max_cycles=70)
        env.reset(seed=3)
        while env.agents:
            actions = circling(env, 0)
            if first_cycle(3.0) <= env.formation.cycles[0] < first_cycle(6.0):
                actions["car_1"] = np.full(2, action, np.float32)
            env.step(actions)
            runs.append((action, env.state().tobytes()))
    n = len(runs) // 2
    assert [bits for _, bits in runs[:n]] == [bits for _, bits in runs[n:]]


def test_the_state_has_zeros_for_absent_cars(life):
    env = make(max_cycles=70)
    env.reset(seed=0)
    for cycle in range(1, 70):
        env.step(circling(env, 0))
        here = env.state().reshape(4, -1)
        assert np.array_equal(here[:, 0] == 1.0, env.formation.state.present[0])
        assert not here[here[:, 0] == 0.0].any()
        assert (here[NEW, 0] == 1.0) == (cycle >= first_cycle(2.0))


@pytest.mark.parametrize("life", [JOIN], indirect=True)
def test_a_newcomer_is_found_within_seconds(life):
    rows = trace(make())
    joins = first_cycle(8.0)
    assert rows[joins - 1][-1]["car_0"]["tracked"] == 2
    tracked = [row[-1]["car_3"]["tracked"] for row in rows[joins:]]
    found = next(k for k, n in enumerate(tracked) if n == 3)
    assert found < 60
    errors = [row[-1]["car_3"].get("tracking_error", np.nan) for row in rows[joins + 60 :]]
    assert np.nanmedian(errors) < 0.6


@pytest.mark.parametrize("life", [OUTAGE], indirect=True)
def test_without_power_a_car_knows_nothing_and_the_others_lose_it(life):
    env = make(observation="estimate_cov")
    rows = trace(env)
    where = {row["name"]: slice(row["first"], row["last"] + 1) for row in index_table(env.fields)}
    off, on = first_cycle(8.0), first_cycle(20.0)
    for cycle, (_, observations, *_) in enumerate(rows[off:on]):
        assert not observations["car_0"][where["mask"]].any()
        status = observations["car_0"][where["status"]].reshape(3, -1)
        assert (np.argmax(status, axis=1) == Status.ABSENT).all()
        assert not observations["car_0"][where["heading"]].any()
        seen = observations["car_3"]
        # The first among the others of car 3 is car 0.
        status = int(np.argmax(seen[where["status"]].reshape(3, -1)[0]))
        if cycle > 60:
            assert status in (Status.ABSENT, Status.LOST, Status.STARTING)
            assert seen[where["mask"]][0] == 0.0
    assert rows[off - 1][1]["car_0"][where["mask"]].any()
    assert any(row[1]["car_0"][where["mask"]].any() for row in rows[on:])
    assert any(row[1]["car_3"][where["mask"]][0] for row in rows[on:])


def test_one_controller_for_all_sees_zeros_in_the_place_of_absent_cars(life):
    env = make(FormationGymEnv, max_cycles=70)
    env.reset(seed=0)
    for _ in range(69):
        observation, *_, info = env.step(np.tile([0.5, 0.1], 4).astype(np.float32))
        rows = observation.reshape(4, -1)
        assert np.array_equal(rows.any(axis=1), env.formation.state.present[0])
        present = env.formation.state.present[0]
        assert not (present & ~info["active"]).any()
        # Absent cars are in no formation: their error does not count as 0.
        assert info["formation_error"] == pytest.approx(env.formation.task.error[0, present].mean())


def waiting(monkeypatch, *more):
    """Return an environment whose new car joins at the start of car 0, which blocks it."""

    def draw(scenario, n_slots, seconds, rng):
        episode = draw_episode(scenario, n_slots, seconds, rng)
        door = tuple(episode.start[0])
        events = [LifeEvent(t=STAND_STILL + 1.0, car=NEW, what="join", pose=door)]
        for t, car, what in more:
            pose = tuple(episode.start[car]) if what == "join" else None
            events.append(LifeEvent(t=STAND_STILL + t, car=car, what=what, pose=pose))
        present = episode.present.copy()
        present[NEW] = False
        return replace(episode, present=present, events=tuple(events))

    monkeypatch.setattr(formation, "draw_episode", draw)
    env = make()
    env.reset(seed=0)
    return env


def drive(env, speed, steps):
    for _ in range(steps):
        env.step({a: np.array([speed, 0.0]) for a in env.agents})
    return env.formation.state.present[0], env.loop.swarm.powered[0]


def test_a_car_that_waits_outside_has_no_power(monkeypatch):
    env = waiting(monkeypatch, (1.5, NEW, "power-off"), (2.0, NEW, "power-on"))
    present, powered = drive(env, 0.0, 30)
    assert not present[NEW]
    assert not powered[NEW]
    present, powered = drive(env, 0.5, 30)
    assert present[NEW]
    assert powered[NEW]


def test_a_car_that_was_to_leave_while_it_waited_does_not_come_in(monkeypatch):
    env = waiting(monkeypatch, (2.0, NEW, "leave"))
    drive(env, 0.0, 30)
    present, _ = drive(env, 0.5, 30)
    assert not present[NEW]
    assert env.loop.swarm._groups[0].next_event == np.inf


def test_two_cars_stay_whoever_waits_outside(monkeypatch):
    env = waiting(monkeypatch, (1.5, 1, "leave"), (2.0, 2, "leave"))
    present, _ = drive(env, 0.0, 30)
    assert present.tolist() == [True, False, True, False]


def test_a_box_that_was_not_pushed_is_in_nobodys_way():
    """Doors are placed next to movable boxes, regardless of their length."""
    kept = []
    env = make(scenario="rooms-9x7", n_cars=6)
    for seed in range(150):
        env.reset(seed=seed)
        group, b = env.loop.swarm._groups[0], env.loop.swarm._bodies
        joins = [e for e in group.life if e.what == "join"]
        b.present[0] = False
        kept += [not group._is_taken(b, 0, event) for event in joins]
    assert len(kept) > 10
    assert all(kept)


def test_a_car_waits_outside_while_another_stands_in_its_door(monkeypatch):
    def draw(scenario, n_slots, seconds, rng):
        episode = draw_episode(scenario, n_slots, seconds, rng)
        door = tuple(episode.start[0])
        event = LifeEvent(t=STAND_STILL + 1.0, car=NEW, what="join", pose=door)
        present = episode.present.copy()
        present[NEW] = False
        return replace(episode, present=present, events=(event,))

    monkeypatch.setattr(formation, "draw_episode", draw)
    env = make()
    env.reset(seed=0)
    for _ in range(30):
        env.step({a: np.zeros(2) for a in env.agents})
    assert "car_3" not in env.agents
    for _ in range(30):
        env.step({a: np.array([0.5, 0.0]) for a in env.agents})
    assert "car_3" in env.agents
    assert not env.loop.swarm.contacts.any()
