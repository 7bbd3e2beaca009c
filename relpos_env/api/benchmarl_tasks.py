"""BenchMARL tasks over `FormationTorchEnv`, and BenchMARL's command line with them.

    python -m relpos_env.api.benchmarl_tasks algorithm=mappo task=relpos/hold task.level=hard

The options are those of ``benchmarl_run``. In Python ``RelposTask.HOLD.get_from_yaml()`` is the
task of a ``benchmarl.experiment.Experiment``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarl import environments
from benchmarl.environments import Task, TaskClass
from torchrl.data import Composite
from torchrl.envs import EnvBase
from yaml import safe_load

from relpos_env.api.torchrl_env import AGENTS, FormationTorchEnv

CONF = Path(__file__).parent / "benchmarl_conf"
"""Folder of configurations for BenchMARL's command line."""
NAME = "relpos"
"""Name of the environment in BenchMARL: tasks are ``relpos/hold`` and so on."""


class RelposClass(TaskClass):  # type: ignore[misc]
    """One task with a configuration: arguments of `relpos_env.config.FormationConfig`."""

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Callable[[], EnvBase]:
        """Return a function that makes a batch of environments, on the processor."""
        actions = "continuous" if continuous_actions else "discrete"
        arguments = {**self.config, "task": self.name.lower(), "actions": actions}

        def make() -> EnvBase:
            env = FormationTorchEnv(num_envs, **arguments)
            env.set_seed(seed)
            return env.to(device)

        return make

    def supports_continuous_actions(self) -> bool:
        """Return True."""
        return True

    def supports_discrete_actions(self) -> bool:
        """Return True."""
        return True

    def max_steps(self, env: EnvBase) -> int:
        """Return the steps of an episode."""
        return int(env.max_episode_steps)

    def has_render(self, env: EnvBase) -> bool:
        """Return False: batches have no pictures."""
        return False

    def group_map(self, env: EnvBase) -> dict[str, list[str]]:
        """Return the one group of all car slots."""
        return {AGENTS: [f"car_{k}" for k in range(env.n_cars)]}

    def observation_spec(self, env: EnvBase) -> Composite:
        """Return the spec of the observations of the cars."""
        return _only(env.full_observation_spec_unbatched, AGENTS, "observation")

    def info_spec(self, env: EnvBase) -> None:
        """Return None."""

    def state_spec(self, env: EnvBase) -> Composite:
        """Return the spec of the true state, for centralised critics."""
        return Composite({"state": env.full_observation_spec_unbatched["state"].clone()})

    def action_spec(self, env: EnvBase) -> Composite:
        """Return the spec of the actions."""
        return env.full_action_spec_unbatched

    def action_mask_spec(self, env: EnvBase) -> None:
        """Return None: every action is always possible."""

    @staticmethod
    def env_name() -> str:
        """Return the name of the environment."""
        return NAME


class RelposTask(Task):  # type: ignore[misc]
    """Tasks by name."""

    RING = None
    HOLD = None
    TRAVEL = None
    GAP = None
    RENDEZVOUS = None
    FOLLOW = None
    OBSERVE = None
    ESCORT = None
    SEEK = None
    INSPECT = None

    @staticmethod
    def associated_class() -> type[RelposClass]:
        """Return the class of the tasks."""
        return RelposClass

    def get_from_yaml(self, path: str | None = None) -> RelposClass:
        """Return the task with the configuration of a file, by default that of the package."""
        file = CONF / "task" / NAME / "base.yaml" if path is None else Path(path)
        return RelposClass(self.name, safe_load(file.read_text(encoding="utf-8")))


def register() -> None:
    """Add the tasks to BenchMARL's registry."""
    tasks = list(RelposTask)  # type: ignore[call-overload]
    found = {f"{NAME}/{task.name.lower()}": task for task in tasks}
    environments.task_config_registry.update(found)


def main() -> None:
    """Run BenchMARL's command line."""
    from benchmarl.run import hydra_experiment

    register()
    if "--config-dir" not in sys.argv:
        sys.argv[1:1] = ["--config-dir", str(CONF)]
    hydra_experiment()


def _only(spec: Composite, group: str, key: str) -> Composite:
    """Return the part of a spec with one key of a group."""
    part = spec[group]
    return Composite(
        {group: Composite({key: part[key].clone()}, shape=part.shape)}, shape=spec.shape
    )


if __name__ == "__main__":
    main()
