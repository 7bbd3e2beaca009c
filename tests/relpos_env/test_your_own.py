"""Tasks, observations, actions, rewards, controllers and filters from outside the package."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gymnasium import spaces

from agents import compare
from agents.comparison.contender import find_entry
from agents.controllers import CONTROLLERS, controller_builder
from agents.errors import UsageError
from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.errors import EnvError
from relpos_env.formation_v0 import parallel_env
from relpos_env.interface.actions import ContinuousActions
from relpos_env.interface.observations.ranges import Ranges
from relpos_env.tasks.rendezvous import Rendezvous
from tracking.constellation import Constellation, NodeConfig
from tracking.errors import ConfigError
from tracking.filters import FILTERS, filter_builder
from tracking.tracker import Tracker

HERE = "tests.relpos_env.test_your_own" if __name__.startswith("tests.") else __name__


class Meet(Rendezvous):
    """A user's task, with weights of its own."""

    default_weights = {"progress": 3.0}  # noqa: RUF012


class Creep(ContinuousActions):
    """Actions at a tenth of the speed."""

    def space(self):
        return spaces.Box(-0.1, 0.1, shape=(2,), dtype=np.float32)


def keep_right(formation):
    """A reward for the right half of the room."""
    return (formation.state.pos_w[..., 0] > 0.0) * 2.0


def sleepy(fields):
    """A controller that does nothing."""

    class Sleepy:
        observations = ("estimate",)

        def act(self, observations):
            return np.zeros((*observations.shape[:-1], 2), np.float32)

    return Sleepy()


def slow_filter(constellation, params, n_envs):
    """A user's filter."""
    return FILTERS["ekf"](constellation, params, n_envs)


def test_the_task_of_the_documentation_runs():
    page = Path(__file__).parents[2] / "docs" / "how-to" / "adding.md"
    codes = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    (code,) = [code for code in codes if "class Spread(Task)" in code]
    names = {}
    exec(code, names)
    assert names["env"].formation.task.terms == ("spread",)
    assert all(-3.0 < reward < 0.0 for reward in names["rewards"].values())


@pytest.mark.parametrize("named", [False, True])
def test_parts_of_an_environment_are_objects_or_names(named):
    def part(thing):
        return f"{HERE}:{thing.__name__}" if named else thing

    env = parallel_env(
        task=part(Meet),
        scenario="ring-los",
        observation="relpos_env.interface.observations.ranges:Ranges" if named else Ranges,
        actions=part(Creep),
        reward=part(keep_right),
        filter=part(slow_filter),
        max_cycles=10,
    )
    observations, _ = env.reset(seed=0)
    plain = parallel_env(task="rendezvous", scenario="ring-los", observation="ranges")
    assert env.fields == plain.fields
    assert env.action_space("car_0").high[0] == np.float32(0.1)
    weights = dict(zip(env.formation.task.terms, env.formation.weights, strict=True))
    assert weights["progress"] == 3.0
    assert weights["formation"] == 1.0
    actions = {a: env.action_space(a).sample() for a in env.agents}
    _, rewards, *_, infos = env.step(actions)
    right = env.formation.state.pos_w[0, :, 0] > 0.0
    for k, (agent, info) in enumerate(infos.items()):
        assert info["reward_own"] == 2.0 * right[k]
        parts = sum(value for key, value in info.items() if key.startswith("reward_"))
        assert rewards[agent] == pytest.approx(parts)
    assert type(env.loop.perception.tracker._filter).__name__ == "PairEkf"


def test_the_mean_reward_of_a_team_has_the_own_term():
    env, plain = FormationGymEnv(reward=keep_right), FormationGymEnv()
    for each in (env, plain):
        each.reset(seed=1)
    action = np.zeros(env.action_space.shape, np.float32)
    reward, less = env.step(action)[1], plain.step(action)[1]
    right = env.formation.state.pos_w[0, :, 0] > 0.0
    assert reward == pytest.approx(less + 2.0 * right.mean())


def test_controllers_and_filters_by_name():
    assert controller_builder(f"{HERE}:sleepy")(()).act(np.zeros((3, 5))).shape == (3, 2)
    assert controller_builder("consensus") is CONTROLLERS["consensus"]
    assert find_entry(f"{HERE}:sleepy").title == f"{HERE}:sleepy"
    constellation = parallel_env(max_cycles=2).reset(seed=0) and None
    assert constellation is None
    assert filter_builder(f"{HERE}:slow_filter") is slow_filter or callable(
        filter_builder(f"{HERE}:slow_filter")
    )


def test_what_is_no_filter_is_refused_before_it_runs():
    who = Constellation(nodes=tuple(NodeConfig(id=k) for k in range(3)), dimensions=2)
    expected = (
        r"filter: expected a function \(constellation, params, n_envs\) that returns a Filter"
    )
    with pytest.raises(ConfigError, match=f"{expected}, got 'os:system'"):
        Tracker(who, filter="os:system")
    with pytest.raises(ConfigError, match=f"{expected}, got .*, which returns tuple"):
        Tracker(who, filter=lambda *given: given)
    with pytest.raises(ConfigError, match="n_envs: expected 1 or more, got 0"):
        Tracker(who, n_envs=0)


class Weighted(Rendezvous):
    """A task with a weight of no term."""

    default_weights = {"speed": 1.0}  # noqa: RUF012


class Lost(Rendezvous):
    """A task whose reward is no number."""

    def compute(self, *given):
        n_changed = super().compute(*given)
        self.rewards[..., 1] = np.nan
        return n_changed


def flat(fields):
    """A controller whose actions are not those of the cars."""

    class Flat:
        def act(self, observations):
            return np.zeros(3)

    return Flat()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("flat", r"actions of the driver: expected \(3, 2\) of an environment, got \(3,\)"),
        ("Meet", "controller: expected a function .* returns a Driver, got"),
        ("Creep", "controller: expected a function .* returns a Driver, got"),
    ],
)
def test_what_is_no_controller_is_refused(name, message):
    with pytest.raises((EnvError, UsageError), match=message):
        compare(drivers=[f"{HERE}:{name}"], episodes=1, seconds=3.0, settle=1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"task": "os:system"}, r"task: expected a function \(n_cars, .* returns a Task, got"),
        ({"task": lambda n_cars, n_envs, room: 3}, "returns a Task, got .*, which returns int"),
        ({"observation": "os:system"}, "observation: expected a function .* ObservationMode, got"),
        ({"observation": lambda *given: given}, "ObservationMode, got .*, which returns tuple"),
        ({"actions": dict}, "actions: expected a function .* ActionMode, got .* returns dict"),
        ({"task": Weighted}, "default_weights of Weighted: expected terms among .*, got 'speed'"),
    ],
)
def test_parts_of_the_wrong_kind_are_named(arguments, message):
    with pytest.raises(EnvError, match=message):
        parallel_env(**arguments)


def test_a_task_whose_reward_is_no_number_is_named():
    with pytest.raises(EnvError, match=r"task .*Lost.*, reward 'progress': expected finite"):
        parallel_env(task=Lost).reset(seed=0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"task": "tag"}, "task: expected one of ring, hold, .* or package.module:Name, got 'tag'"),
        ({"task": "os:sep"}, "task: cannot import 'os:sep': expected something to call"),
        ({"task": "no.such:Thing"}, "task: cannot import 'no.such:Thing': No module named 'no'"),
        ({"observation": 3}, "observation: expected one of estimate"),
        ({"actions": "json:nothing"}, "actions: cannot import 'json:nothing'"),
        ({"reward": "sparse"}, "reward: expected one of"),
        ({"filter": "kalman"}, "filter: expected one of joint"),
    ],
)
def test_what_cannot_be_found_is_named(arguments, message):
    with pytest.raises(EnvError, match=message):
        parallel_env(**arguments)
    with pytest.raises(ConfigError, match="filter: cannot import 'a:b'"):
        filter_builder("a:b")
    with pytest.raises(UsageError, match="controller: cannot import 'a:b'"):
        find_entry("a:b")


def test_a_reward_of_the_wrong_shape_is_refused():
    env = parallel_env(reward=lambda formation: np.zeros(7))
    env.reset(seed=0)
    with pytest.raises(EnvError, match=r"reward: expected finite numbers \(1, 3\)"):
        env.step({agent: np.zeros(2, np.float32) for agent in env.agents})


def test_entry_points_of_an_installed_package_are_names(tmp_path, monkeypatch):
    (tmp_path / "swarmland.py").write_text(
        "import numpy as np\n"
        "def sleepy(fields):\n"
        "    class S:\n"
        "        observations = ('estimate',)\n"
        "        def act(self, o): return np.zeros((*o.shape[:-1], 2), np.float32)\n"
        "    return S()\n"
    )
    info = tmp_path / "swarmland-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: swarmland\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[relpos_env.controllers]\nsleepy = swarmland:sleepy\n")
    relpos = Path(sys.executable).with_name("relpos")
    folder = tmp_path / "current"
    folder.mkdir()
    (folder / "here.py").write_text("from swarmland import sleepy\n")
    path = {"PYTHONPATH": str(tmp_path), "PATH": str(relpos.parent)}
    command = [
        relpos, "compare", "sleepy", "swarmland:sleepy", "here:sleepy", "--episodes", "1",
        "--seconds", "3", "--settle", "1", "--json",
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, env=path, check=True, cwd=folder)
    for name in ("sleepy", "swarmland:sleepy", "here:sleepy"):
        assert f'"{name}"' in done.stdout
