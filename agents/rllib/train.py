"""Training with RLlib: the function behind `relpos rllib`."""

from __future__ import annotations

import json
import logging
import platform
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.callbacks.callbacks import RLlibCallback
from ray.rllib.core.rl_module.multi_rl_module import MultiRLModuleSpec
from ray.rllib.core.rl_module.rl_module import RLModuleSpec

from agents.errors import UsageError
from agents.jobs.ray_engine import cluster
from agents.output import check_folder, check_new, write_results
from agents.policies.layout import Layout
from agents.rllib.config import RllibConfig
from agents.rllib.env import SeededEnv
from agents.rllib.export import export_module
from agents.rllib.module import CarModule, gain_of

MODULE = "car"
"""RLlib's ID of the network that all cars share."""
POLICY, CHECKPOINT, LOG = "policy", "checkpoint", "training.jsonl"
"""Files of a run: policy, RLlib checkpoint, and log with one record per iteration."""
SAVE_EVERY = 20
"""[-] Number of iterations between writes; files are also written at the end."""
EPISODES = 100
"""[-] Number of last episodes in the mean of episode metrics."""
PACKAGES = ("relpos-env", "ray", "torch", "gymnasium", "numpy", "numba")


@dataclass(frozen=True, slots=True, kw_only=True)
class RllibResult:
    """Result of a training."""

    policy: Path
    """File of the network; the card is next to it."""
    checkpoint: Path
    """Folder of the RLlib checkpoint."""
    records: list[dict[str, Any]]
    """Records by iteration."""


class FormationCallback(RLlibCallback):  # type: ignore[misc]
    """Callback that logs the formation error of episodes."""

    def on_episode_end(self, *, env: Any, env_index: int, metrics_logger: Any, **_: Any) -> None:
        """Log the formation error of the episode [m]."""
        error = env.envs[env_index].unwrapped.formation_error
        if np.isfinite(error):
            metrics_logger.log_value("formation_error", error, window=EPISODES)


def rllib_train(
    config: RllibConfig,
    folder: Path,
    *,
    address: str | None = None,
    progress: Callable[[dict[str, Any]], None] | None = None,
) -> RllibResult:
    """Train, then write policy, checkpoint and log.

    Args:
        config: Configuration of the run.
        folder: New or empty folder.
        address: Address of a running cluster; None starts one on this machine with one core per
            worker and stops it afterwards.
        progress: Function that is called with the record of every iteration.

    Raises:
        UsageError: No ray, no cluster, or a folder that cannot be written to.
        EnvError: The arguments of the environment are invalid.
    """
    check_new(folder)
    check_folder(folder, [LOG])
    # RLlib warns of its own deprecated interfaces.
    logging.getLogger("ray.rllib").setLevel(logging.ERROR)
    layout = config.layout
    records: list[dict[str, Any]] = []
    with cluster(max(1, config.workers), address), _algorithm(config) as algorithm:
        for k in range(1, config.iterations + 1):
            begun = time.perf_counter()
            found = algorithm.train()
            records.append(_record(found, time.perf_counter() - begun))
            if progress is not None:
                progress(records[-1])
            if k % SAVE_EVERY == 0 or k == config.iterations:
                policy = _save(algorithm, config, layout, folder, records)
    return RllibResult(policy=policy, checkpoint=folder / CHECKPOINT, records=records)


def _save(
    algorithm: Any,
    config: RllibConfig,
    layout: Layout,
    folder: Path,
    records: list[dict[str, Any]],
) -> Path:
    """Overwrite log, checkpoint and policy; return the file of the policy."""
    lines = "".join(json.dumps(r, allow_nan=False) + "\n" for r in records)
    write_results(folder, {LOG: lines})
    _save_checkpoint(algorithm, folder)
    training = {
        "command": "relpos rllib",
        "task": config.arguments.get("task"),
        "scenario": config.record["arguments"].get("scenario"),
        "config": config.record,
        "seed": config.seed,
        "frames": records[-1]["env_steps"],
        "measured": records[-1],
        "versions": {p: _version(p) for p in PACKAGES} | {"python": platform.python_version()},
    }
    return export_module(algorithm.get_module(MODULE), layout, folder, POLICY, training)


def _save_checkpoint(algorithm: Any, folder: Path) -> None:
    """Replace the RLlib checkpoint; after an interruption, the folder has a complete one.

    Raises:
        UsageError: The checkpoint cannot be written.
    """
    place = (folder / CHECKPOINT).resolve()
    fresh, former = (place.with_name(f"{CHECKPOINT}.{end}") for end in ("new", "old"))
    try:
        shutil.rmtree(fresh, ignore_errors=True)
        algorithm.save_to_path(fresh)
        if place.exists():
            shutil.rmtree(former, ignore_errors=True)
            place.rename(former)
        fresh.rename(place)
        shutil.rmtree(former, ignore_errors=True)
    except OSError as error:
        raise UsageError(f"--out {folder}: cannot be written to ({error.strerror})") from error


def ppo_config(config: RllibConfig) -> PPOConfig:
    """Return the configuration for RLlib, also as a base for other settings.

    Raises:
        EnvError: The arguments of the environment are invalid.
    """
    model = {"gain": gain_of(config.layout).tolist(), "width": config.width}
    spec = RLModuleSpec(module_class=CarModule, model_config=model)
    return (
        PPOConfig()
        .api_stack(enable_rl_module_and_learner=True, enable_env_runner_and_connector_v2=True)
        .environment(
            SeededEnv,
            env_config={"arguments": dict(config.arguments), "seed": config.seed},
            disable_env_checking=True,
            normalize_actions=False,
            clip_actions=True,
        )
        .env_runners(
            num_env_runners=config.workers,
            num_envs_per_env_runner=config.envs,
            num_cpus_per_env_runner=1,
            rollout_fragment_length="auto",
        )
        .multi_agent(policies={MODULE}, policy_mapping_fn=_one_for_all)
        .rl_module(rl_module_spec=MultiRLModuleSpec(rl_module_specs={MODULE: spec}))
        .training(
            lr=config.learning_rate,
            gamma=config.gamma,
            lambda_=config.trace,
            clip_param=config.clip,
            # Returns are not scaled, so value updates are not clipped.
            vf_clip_param=float("inf"),
            vf_loss_coeff=0.5,
            use_kl_loss=False,
            grad_clip=0.5,
            grad_clip_by="global_norm",
            num_epochs=config.epochs,
            minibatch_size=min(config.minibatch, config.steps),
            train_batch_size_per_learner=config.steps,
        )
        .learners(num_learners=0)
        .callbacks(FormationCallback)
        .fault_tolerance(restart_failed_env_runners=True)
        .reporting(metrics_num_episodes_for_smoothing=EPISODES)
        .debugging(seed=config.seed, log_level="ERROR")
    )


def _one_for_all(agent: str, episode: Any, **_: Any) -> str:
    """Return the same network for every car."""
    return MODULE


@contextmanager
def _algorithm(config: RllibConfig) -> Iterator[Any]:
    algorithm = ppo_config(config).build_algo()
    try:
        yield algorithm
    finally:
        algorithm.stop()


def _record(found: dict[str, Any], seconds: float) -> dict[str, Any]:
    """Return the record of an iteration for JSON; None for metrics without episodes."""
    runners = found["env_runners"]
    steps = float(runners["num_env_steps_sampled"])
    return {
        "iteration": int(found["training_iteration"]),
        "env_steps": int(runners["num_env_steps_sampled_lifetime"]),
        "episodes": int(runners.get("num_episodes_lifetime", 0)),
        "return": _number(runners.get("episode_return_mean")),
        "formation_error": _number(runners.get("formation_error")),
        "env_steps_per_s": steps / seconds,
    }


def _number(value: Any) -> float | None:
    """Return a finite number, or None."""
    return None if value is None or not np.isfinite(value) else float(value)


def _version(package: str) -> str | None:
    """Return the version of a package; None if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None
