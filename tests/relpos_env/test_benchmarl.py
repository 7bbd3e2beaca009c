"""BenchMARL: tasks, specs, four algorithms and the command line (`make benchmarl`)."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("benchmarl", reason="no BenchMARL here: make benchmarl")

import torch
from benchmarl.algorithms import IppoConfig, MappoConfig, MasacConfig, QmixConfig
from benchmarl.environments import task_config_registry
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models import GruConfig
from benchmarl.models.mlp import MlpConfig

from relpos_env.api.benchmarl_tasks import CONF, RelposTask, register
from relpos_env.errors import EnvError
from relpos_env.tasks import TASKS

pytestmark = pytest.mark.filterwarnings("ignore")
ROOT = Path(__file__).parents[2]
SIZES = {
    "max_n_frames": 400, "evaluation": True, "evaluation_interval": 200, "evaluation_episodes": 2,
    "render": False, "loggers": [], "checkpoint_interval": 0, "checkpoint_at_end": False,
    "on_policy_collected_frames_per_batch": 200, "on_policy_n_envs_per_worker": 10,
    "on_policy_n_minibatch_iters": 1, "on_policy_minibatch_size": 100,
    "off_policy_collected_frames_per_batch": 200, "off_policy_n_envs_per_worker": 10,
    "off_policy_train_batch_size": 32, "off_policy_n_optimizer_steps": 2,
    "off_policy_memory_size": 1000,
}  # fmt: skip


def task_of(name, **changes):
    task = RelposTask[name.upper()].get_from_yaml()
    task.config.update({"max_cycles": 20, **changes})
    return task


def test_every_task_is_there_with_a_configuration():
    assert [task.name.lower() for task in RelposTask] == list(TASKS)
    files = {path.stem for path in (CONF / "task" / "relpos").glob("*.yaml")}
    assert files == {*TASKS, "base"}
    register()
    assert task_config_registry["relpos/hold"] is RelposTask.HOLD


@pytest.mark.parametrize("continuous", [True, False])
def test_specs_are_those_of_one_environment(continuous):
    task = task_of("hold", scenario="cars-nlos")
    env = task.get_env_fun(4, continuous, 3, "cpu")()
    assert task.group_map(env) == {"agents": ["car_0", "car_1", "car_2"]}
    assert task.max_steps(env) == 20
    action = task.action_spec(env)["agents", "action"]
    assert action.shape == ((3, 2) if continuous else (3,))
    observation = task.observation_spec(env)
    assert list(observation.keys(True, True)) == [("agents", "observation")]
    rollout = env.rollout(3)
    assert rollout["agents", "observation"].shape[2:] == observation["agents", "observation"].shape
    assert rollout["state"].shape[2:] == task.state_spec(env)["state"].shape


def test_the_seed_is_that_of_the_other_forms():
    first, same, other = (
        task_of("ring").get_env_fun(2, True, seed, "cpu")().reset()["agents", "observation"]
        for seed in (5, 5, 6)
    )
    assert torch.equal(first, same)
    assert not torch.equal(first, other)
    assert torch.equal(first[1], other[0])


def experiment_of(algorithm, model, folder):
    config = ExperimentConfig.get_from_yaml()
    for name, value in SIZES.items():
        assert hasattr(config, name)
        setattr(config, name, value)
    config.save_folder = str(folder)
    # Cars join and leave in this scenario.
    return Experiment(
        task=task_of("hold", scenario="swarm-nlos"),
        algorithm_config=algorithm.get_from_yaml(),
        model_config=model.get_from_yaml(),
        critic_model_config=MlpConfig.get_from_yaml(),
        seed=0,
        config=config,
    )


@pytest.mark.parametrize(
    ("algorithm", "model"),
    [
        (MappoConfig, MlpConfig),
        (IppoConfig, MlpConfig),
        (QmixConfig, MlpConfig),
        (MasacConfig, MlpConfig),
        (MappoConfig, GruConfig),
    ],
)
def test_algorithms_learn(algorithm, model, tmp_path):
    experiment = experiment_of(algorithm, model, tmp_path)
    before = [p.clone() for p in experiment.policy.parameters()]
    experiment.run()
    after = list(experiment.policy.parameters())
    assert any(not torch.equal(a, b) for a, b in zip(before, after, strict=True))
    assert all(torch.isfinite(p).all() for p in after)
    (told,) = tmp_path.rglob("*.json")
    assert "relpos" in json.loads(told.read_text())


@pytest.mark.parametrize(("algorithm", "is_central"), [(MappoConfig, True), (IppoConfig, False)])
def test_critics_see_the_state_or_their_car_and_policies_never_the_state(
    algorithm, is_central, tmp_path
):
    experiment = experiment_of(algorithm, MlpConfig, tmp_path)
    (loss,) = experiment.losses.values()
    assert ("state" in loss.critic_network.in_keys) == is_central
    assert "state" not in loss.actor_network.in_keys


def test_the_command_line_takes_tasks_and_levels(tmp_path):
    sizes = [f"experiment.{k}={str(v).lower()}" for k, v in SIZES.items() if k != "loggers"]
    options = [*sizes, "experiment.loggers=[]", "experiment.evaluation=false"]
    command = [sys.executable, "-m", "relpos_env.api.benchmarl_tasks", "algorithm=ippo"]
    done = subprocess.run(
        [*command, "task=relpos/gap", "task.level=easy", "task.max_cycles=20", *options],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "level: easy" in done.stdout


def test_the_notebook_runs(tmp_path):
    page = (ROOT / "docs" / "tutorials" / "notebook-benchmarl.md").read_text()
    code = "\n".join(re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE))
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "mean return of the last batch" in done.stdout


def test_wrong_arguments_are_named():
    with pytest.raises(EnvError, match="level: expected 0 to 4 or one of easy, .*, got 'tough'"):
        task_of("hold", level="tough").get_env_fun(2, True, 0, "cpu")()
