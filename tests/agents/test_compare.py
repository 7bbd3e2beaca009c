"""Comparison of drivers: figures per episode, and statements with intervals."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from gymnasium.utils import seeding

from agents.cli.main import main
from agents.comparison import contender as contenders
from agents.comparison.compare import compare
from agents.comparison.contender import Contender, ControllerEntry, find_entry, line_up
from agents.comparison.episode import run_episodes
from agents.comparison.film import median_films
from agents.comparison.meter import IN_FORMATION, Meter
from agents.comparison.setting import Setting
from agents.comparison.simulated import Simulated
from agents.comparison.statistics import Interval
from agents.controllers import CONTROLLERS, Consensus
from agents.errors import UsageError
from agents.reports.animation import player_markup
from agents.reports.compare_figures import _limits
from agents.reports.compare_report import (
    HEADER,
    SHORT_HEADER,
    compare_files,
    notes,
    rows,
    short_rows,
)
from relpos_env.api.sb3_vec_env import FormationVecEnv
from relpos_env.core.env_core import EnvCore
from relpos_env.interface.observations import OBSERVATIONS
from relpos_env.scenarios import SCENARIOS
from relpos_env.tasks import TASKS
from tests.command_line import relpos

ON_ESTIMATE = Contender("consensus", "estimate")
SHORT = Setting(scenario="cars-nlos", seconds=4.0, settle=2.0)
KEYS = {
    "policy", "trained_on", "observation", "scenario", "episodes", "formation_error", "ci95",
    "collisions_per_min", "tracking_error", "contact_time",
    "time_in_formation", "energy", "seconds",
    "done_share", "cars", "task", "level", "operator",
}  # fmt: skip


def same(one, other):
    for name in one.__slots__:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("mode", ["estimate", "estimate_cov", "truth"])
def test_an_episode_is_the_same_alone_and_in_any_batch(mode):
    who, setting = Contender("consensus", mode), replace(SHORT, level=3)
    batch = run_episodes(who, setting, [7, 1003, 12, 1001])
    same(run_episodes(who, setting, [1003])[0], batch[1])
    same(run_episodes(who, setting, [1001, 7])[0], batch[3])


def test_figures_do_not_depend_on_the_number_of_jobs():
    arguments = {"drivers": ["consensus"], "scenarios": ["cars-nlos"], "episodes": 11}
    alone = compare(**arguments, seconds=1.0, settle=0.5)
    shared = compare(**arguments, seconds=1.0, settle=0.5, jobs=2)
    assert alone.records == shared.records
    assert alone.episode_records == shared.episode_records
    assert [r["seed"] for r in alone.episode_records] == list(range(1000, 1011))


def test_figures_are_those_of_the_environment():
    """The same episode in the training form: seeds have the same meaning there."""
    (episode,) = run_episodes(ON_ESTIMATE, SHORT, [1002])
    parts = SHORT.parts("estimate", 1)
    envs = FormationVecEnv(scenario="cars-nlos", max_cycles=40)
    envs.seed(1002)
    seen, controller = envs.reset(), Consensus(parts.mode.fields)
    error, tracking, contacts, touching = [], [], 0.0, []
    for _ in range(39):  # the 40th step starts the next episode
        seen = envs.step(np.array([controller.act(o) for o in seen]))[0]
        error.append(envs.formation.task.error[0].mean())
        tracking.append(envs.formation.tracking_error()[0])
        contacts += envs.formation.loop.swarm.contacts[0].sum()
        touching.append(envs.formation.state.clearance[0] == 0.0)
    np.testing.assert_allclose(episode.error[:39], error)
    assert episode.seconds == 4.0
    assert not episode.done
    assert episode.formation_error == pytest.approx(episode.error[20:].mean())
    # The last step is not in the list.
    expected = np.nanmean(tracking[20:], axis=1).mean()
    assert episode.tracking_error == pytest.approx(expected, rel=0.05)
    assert episode.collisions_per_min == pytest.approx(60.0 * contacts / 4.0)
    assert episode.contact_time == pytest.approx(np.mean(touching), abs=0.03)


def test_time_in_formation_is_that_of_the_worst_car():
    (episode,) = run_episodes(ON_ESTIMATE, SHORT, [1004])
    parts = SHORT.parts("estimate", 1)
    formation, controller = EnvCore(parts), Consensus(parts.mode.fields)
    formation.seed(0, seeding.np_random(1004)[0])
    formation.begin([0])
    formed = []
    while not formation.truncated[0]:
        actions = np.array([[controller.act(o) for o in formation.observations[0]]])
        formation.step(*parts.actions.decode(actions, "actions"))
        formed.append((formation.task.error[0] < IN_FORMATION).all())
    assert episode.time_in_formation == pytest.approx(np.mean(formed[20:]))


class Constant:
    """A driver with the same action for every car."""

    def __init__(self, action):
        self._action = np.float32(action)

    def act(self, observations):
        return np.broadcast_to(self._action, (*observations.shape[:-1], 2))


@pytest.fixture
def constant(monkeypatch):
    """Use drivers named by their speed share, with estimates of at most three cars."""

    class Entry(ControllerEntry):
        def refusal(self, observation, n_cars, proximity):
            return None if observation == "estimate" else "expected observation 'estimate'"

        def driver(self, observation, n_cars, proximity):
            return Constant([float(self.title), 0.0])

    def find(name):
        return Entry(name, trained_on="estimate") if name[0].isdigit() else None

    monkeypatch.setattr(contenders, "SOURCES", (find, *contenders.SOURCES))


def test_energy_is_what_speeds_up_and_rolls(constant):
    (standing,) = run_episodes(Contender("0", "estimate"), replace(SHORT, scenario="open"), [1000])
    assert standing.energy < 0.1
    setting = replace(SHORT, scenario="hall", seconds=3.0, cars=2)
    (driving,) = run_episodes(Contender("0.5", "estimate"), setting, [1000])
    car = setting.parts("estimate", 1).scenario.car
    rolling = car.rolling_resistance * car.mass * 9.81
    # Up to 1 m/s within the first second, then at that speed; a motor has some lag.
    expected = 0.5 * car.mass + rolling * 2.6
    assert driving.energy / 60.0 * 3.0 == pytest.approx(expected, rel=0.1)


def test_what_a_driver_cannot_see_is_left_out_and_noted(constant):
    result = compare(
        drivers=["consensus", "0.1"], observations=["estimate", "truth"],
        scenarios=["cars-nlos"], episodes=2, seconds=1.0, settle=0.0,
    )  # fmt: skip
    assert [r.contender.label for r in result.rows] == [
        "consensus on estimate", "consensus on truth", "0.1 on estimate",
    ]  # fmt: skip
    assert result.notes == ("0.1 on truth in cars-nlos: expected observation 'estimate'",)
    assert [r["trained_on"] for r in result.records] == [None, None, "estimate"]
    assert {r["reference"] for r in result.records} == {"consensus on estimate"}
    assert any("Left out: 0.1 on truth" in line for line in notes(result))
    with pytest.raises(UsageError, match="NAME: nothing to compare: 0.1 on truth in cars-nlos: "):
        compare(drivers=["0.1"], observations=["truth"], scenarios=["cars-nlos"], episodes=1)


def test_a_task_that_is_done_ends_its_episode():
    setting = Setting(task="rendezvous", seconds=60.0, settle=10.0)
    episodes = run_episodes(Contender("consensus", "truth"), setting, range(1000, 1008))
    for e in episodes:
        assert e.done == (e.seconds < 60.0)
        assert len(e.error) == round(e.seconds / 0.1)
        assert np.isfinite(e.formation_error)
    assert any(e.done for e in episodes)


@pytest.fixture(scope="module")
def result():
    return compare(
        drivers=["consensus"], observations=["estimate", "truth"],
        scenarios=["cars-nlos", "ring-los"], episodes=3, seconds=3.0, settle=1.0,
    )  # fmt: skip


def test_records_are_means_of_episodes(result):
    assert [(r["scenario"], r["observation"]) for r in result.records] == [
        ("cars-nlos", "estimate"), ("cars-nlos", "truth"),
        ("ring-los", "estimate"), ("ring-los", "truth"),
    ]  # fmt: skip
    for record, row in zip(result.records, result.rows, strict=True):
        assert set(record) >= KEYS
        json.dumps(record, allow_nan=False)
        errors = [e.formation_error for e in row.episodes]
        assert record["formation_error"] == pytest.approx(np.mean(errors))
        low, high = record["ci95"]
        ulp = 1e-12  # of a mean of equal numbers
        assert min(errors) - ulp <= low <= record["formation_error"] <= high <= max(errors) + ulp
        assert sorted(errors)[1] == row.median_episode.formation_error
    assert len(result.episode_records) == 4 * 3


def test_the_median_episode_is_filmed_as_it_was(result):
    films = median_films(result)
    for row, frames in zip(result.rows, films, strict=True):
        error = row.median_episode.error
        np.testing.assert_allclose(frames["formation"], error, atol=0.0006)
    files = compare_files(result, films)
    page = files["report.html"]
    assert page.count("<canvas") == 2
    assert page.count("data:image/svg+xml;base64") == 4
    assert len(files["results.jsonl"].splitlines()) == 4 + 12
    for scenario in result.groups:
        assert {len(line) for line in rows(result, scenario)} == {len(HEADER)}
        assert {len(line) for line in short_rows(result, scenario)} == {len(SHORT_HEADER)}


def test_a_name_cannot_end_the_script():
    assert "</script><b>" not in player_markup({"</script><b>": {}})


def test_names_that_clash_are_told_apart(monkeypatch):
    def find(name):
        return ControllerEntry("same")

    monkeypatch.setattr(contenders, "SOURCES", (find,))
    assert [c.called for c in line_up(["a.onnx", "b.onnx"], ["truth"])] == ["a.onnx", "b.onnx"]
    assert [c.called for c in line_up(["a.onnx"], ["truth"])] == ["same"]


def test_unknown_names_are_refused():
    with pytest.raises(
        UsageError, match="NAME: expected one of consensus.* or the file of a policy, got 'magic'"
    ):
        find_entry("magic")


def test_help_names_what_there_is():
    page = "".join(relpos("compare", "--help").stdout.split())  # lines break at hyphens
    names = (*CONTROLLERS, *OBSERVATIONS, *SCENARIOS, *TASKS)
    assert [name for name in names if name not in page] == []


def test_the_command_line_writes_a_report_and_rows(tmp_path):
    args = ("consensus", "--scenario", "cars-nlos", "--episodes", 2, "--seconds", 2, "--settle", 1)
    done = relpos("compare", *args, "--json", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    (row,) = [json.loads(line) for line in done.stdout.splitlines()]
    assert set(row) >= KEYS
    kept = (tmp_path / "out" / "results.jsonl").read_text().splitlines()
    assert json.loads(kept[0]) == row
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "report.html", "results.jsonl", "compare-figures.svg", "compare-time.svg",
        "compare-scatter.svg",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["magic"], "NAME: expected one of consensus"),
        ([], "Missing argument 'NAME...'"),
        (["consensus", "--observation", "moon"], "--observation: expected one of estimate"),
        (["consensus", "--scenario", "moon"], "scenario: expected one of"),
        (["consensus", "--task", "dance"], "task: expected one of"),
        (["consensus", "--level", "9"], "level: expected 0 to 4 or one of easy"),
        (["consensus", "--cars", "40"], "n_cars: expected a whole number from 2 to 20"),
        (["consensus", "--episodes", "0"], "--episodes: expected 1 to 10000, got 0"),
        (["consensus", "--first-seed", "-1"], "--first-seed: expected 0 or more"),
        (["consensus", "--seconds", "nan"], "--seconds: expected 0.1 to 3600"),
        (["consensus", "--settle", "60"], "--settle: expected 0 to less than --seconds"),
        (["consensus", "--jobs", "0"], "--jobs: expected 1 to 1024, got 0"),
        (["consensus", "--engine", "moon"], "--engine: expected one of local"),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, list) else "",
)
def test_faults_end_in_one_line_and_write_nothing(args, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["relpos", "compare", *args, "--out", "out"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    shown = capsys.readouterr()
    assert message in shown.err
    assert shown.out == ""
    assert list(tmp_path.iterdir()) == []


def test_time_in_contact_tells_who_presses_on():
    """There is one contact, and cars that keep driving against it."""
    parts = SHORT.parts("estimate", 1)
    running = Simulated(parts, [1000, 1001])
    meter = Meter(running)
    touching = []
    for _ in range(running.cycles):
        running.step(np.full((2, parts.n_cars, 2), (0.5, 0.0), np.float32))
        meter.read()
        touching.append(running.clearance == 0.0)
    found = [meter.result(env, 0, 10).contact_time for env in range(2)]
    np.testing.assert_allclose(found, np.mean(touching, axis=(0, 2)))
    assert min(found) > 0.05
    running.close()


def test_no_bar_is_cut_off():
    """Shares are drawn in percent, and so are the limits of their axes."""
    found = [Interval(0.004, 0.002, 0.01)]
    for name in ("contact_time", "time_in_formation"):
        assert _limits(name, found)[1] >= 100.0 * 0.01
    assert _limits("formation_error", found)[1] < 0.02


@pytest.mark.parametrize("share", [-0.1, 1.5, float("nan")])
def test_a_share_of_episodes_with_an_operator_is_checked(share):
    with pytest.raises(UsageError, match="--operator: expected 0 to 1"):
        compare(drivers=["consensus"], operator=share, episodes=1)


def test_without_an_operator_cars_follow_the_plan_alone():
    """The plan is at rest if a formation is to be held."""
    for share in (0.0, 1.0):
        parts = replace(SHORT, task="hold", operator=share).parts("estimate", 1)
        formation = Simulated(parts, [1000, 1001]).formation
        moves = np.abs(formation.operator.command - formation.task.plan).max(axis=(1, 2)) > 0.0
        assert moves.all() == bool(share)
        assert moves.any() == bool(share)
