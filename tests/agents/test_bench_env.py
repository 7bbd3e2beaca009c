import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from agents.bench.env import bench_env, rows, two_processes
from agents.bench.env.batch import Batch
from agents.bench.env.drives import Chance, followed
from agents.bench.env.effort import QUICK, Effort
from agents.bench.env.memory import array_bytes
from agents.bench.env.parts import BOUND, METHODS, REST, parts_of
from agents.bench.env.peer_mpe2 import Spread, mpe2_name
from agents.bench.env.peer_pymunk import Rooms
from agents.bench.env.turns import best_of_turns

TINY = Effort(
    envs=2,
    two_cores=(2,),
    growth_envs=(1, 2),
    growth_cars=(2, 3),
    turns=1,
    resets=0,
    warm_up=1,
    patience=0.1,
)
KEYS = {
    "bench", "what", "envs", "cars", "threads", "processes", "env_steps_per_s", "us_per_env_step",
    "peer", "ratio",
}  # fmt: skip


def test_turns_are_taken_and_the_best_counts():
    order, times = [], {"a": [3.0, 1.0, 2.0], "b": [5.0, 6.0, 4.0]}

    def job(name):
        def turn():
            order.append(name)
            return times[name][order.count(name) - 1]

        return turn

    assert best_of_turns([job("a"), job("b")], 3) == [1.0, 4.0]
    assert "".join(order) == "ababab"


def test_resets_are_spread_evenly_over_the_turns():
    batch = Batch(60, followed, resets=1)
    assert batch.steps == 10
    began = []
    begin = batch.env.formation.begin
    batch.env.formation.begin = lambda envs, **more: (began.extend(envs), begin(envs, **more))
    batch.turn()
    assert began == [59]
    batch.turn()
    assert began == [59, 58]


def test_cars_that_follow_keep_their_places_and_touch_nothing():
    batch = Batch(2, followed, resets=1)
    batch.env.formation.cycles[:] = 0
    batch.warm_up(100)
    formation = batch.env.formation
    away = np.linalg.norm(formation.task.goal_w - formation.state.pos_w, axis=-1)
    assert away.max() < 0.6
    assert parts_of(replaced(batch, steps=20)).solver_share == 0.0


def test_chance_asks_for_what_cars_can_do():
    formation = Batch(2, followed, resets=1).env.formation
    chance = Chance(3)
    actions = np.array([chance(formation) for _ in range(50)])
    assert actions.shape == (50, 2, 3, 2)
    assert np.all((actions[..., 0] > 0.1) & (actions[..., 0] < 0.5))
    assert np.abs(actions[..., 1]).max() <= 1.0
    assert np.abs(np.diff(actions, axis=0)).mean() < 0.3 * np.abs(actions[..., 1]).mean() + 0.1


def replaced(batch, steps):
    batch.steps = steps
    return batch


def test_parts_sum_to_the_whole_and_are_put_back():
    batch = replaced(Batch(2, Chance(), resets=1), steps=30)
    before = [getattr(owner, name) for _, owner, name in METHODS]
    parts = parts_of(batch, 2)
    assert [getattr(owner, name) for _, owner, name in METHODS] == before
    assert set(parts.cost) == {name for name, *_ in METHODS} | {name for name, _ in BOUND} | {REST}
    assert all(cost > 0.0 for name, cost in parts.cost.items() if name != "resets")
    assert parts.cost["resets"] == 0.0
    assert sum(parts.cost.values()) == pytest.approx(parts.total)
    assert 0.0 <= parts.solver_share <= 1.0


@pytest.mark.parametrize("name", ["ring-los", "ring-nlos"])
def test_the_cars_of_bare_pymunk_go_round_their_ring(name):
    rooms = Rooms(2, resets=1, name=name)
    for _ in range(2):
        rooms.turn()
        radius = np.linalg.norm(rooms.positions(), axis=-1)
        assert radius == pytest.approx(1.4, abs=1e-6)


def test_mpe2_goes_on_after_its_episode():
    if mpe2_name() is None:
        pytest.skip("mpe2 is not installed")
    peer = Spread()
    assert peer.turn(601) > 0.0
    assert len(peer._env.agents) == 3


def test_memory_counts_every_array_once():
    batch = Batch(2, followed, resets=1)
    formation = batch.env.formation
    held = array_bytes(formation)
    assert held > formation.loop.swarm.events.values.nbytes
    shared = np.zeros(100)
    assert array_bytes([shared, shared[2:], {"a": (shared,)}]) == shared.nbytes
    larger = array_bytes(Batch(4, followed, resets=1).env.formation)
    assert larger == pytest.approx(2.0 * held, rel=0.1)


def test_every_figure_is_a_row(monkeypatch):
    monkeypatch.setattr(rows, "processes_cost", lambda *_, **__: 10.0)
    shares = []
    # A round without resets has no steps; in these tests it has three.
    monkeypatch.setattr("agents.bench.env.batch.ceil", lambda _: 3)
    monkeypatch.setattr("agents.bench.env.peer_pymunk.ceil", lambda _: 3)
    monkeypatch.setattr(rows, "EPISODE", 3)
    found = bench_env(replace(TINY, resets=1), progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    for row in found:
        assert set(row) >= KEYS
        assert json.loads(json.dumps(row, allow_nan=False)) == row
        assert (row["peer"] is None) == (row["ratio"] is None)
    whats = [row["what"] for row in found]
    assert "ring-los, followed: filter" in whats
    assert [r["cars"] for r in found if r["what"] == "growth, open"] == [2, 3]
    assert sum("solver_share" in row for row in found) == 3
    check_picture(found)
    check_table(found, monkeypatch)


def check_picture(found):
    from agents.reports.bench.env_figures import env_figure
    from agents.reports.style import svg

    assert svg(env_figure(found)).startswith(b"<?xml")


def check_table(found, monkeypatch):
    from agents.cli.main import cli

    monkeypatch.setattr("agents.bench.env.bench_env", lambda *_, **__: found)
    shown = CliRunner().invoke(cli, ["bench", "env", "--quick"])
    assert shown.exit_code == 0, shown.output
    assert "of sub-steps" in shown.output
    lines = CliRunner().invoke(cli, ["bench", "env", "--json"]).output.splitlines()
    assert len(lines) == len(found)


def test_a_missing_peer_is_told(monkeypatch):
    monkeypatch.setattr(rows, "mpe2_name", lambda: None)
    monkeypatch.setattr(rows, "EPISODE", 3)
    notes = []
    row = rows._single(replace(TINY, resets=1), notes.append)
    assert row["peer"] is None
    assert row["ratio"] is None
    assert "mpe2" in notes[0]


@pytest.mark.slow
def test_two_processes_step_at_the_same_time():
    cost = two_processes.processes_cost(1, 2, resets=1, warm_up=1, turns=1)
    assert cost > 0.0


def test_quick_is_less_of_the_same():
    assert max(QUICK.growth_envs) < max(Effort().growth_envs)
    assert QUICK.turns < Effort().turns
