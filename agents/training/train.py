"""Training of one policy for all cars (`relpos train`).

A run consists of evaluation intervals. Each begins with new episodes
and generators reseeded from the run's seed and the index of the interval, and ends with an
evaluation and a checkpoint. A run resumed from a checkpoint is therefore identical to an
uninterrupted one, and no state of simulations, generators or threads has to be stored.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
from torch import Tensor

from agents.errors import UsageError
from agents.training.begin import begin_with
from agents.training.config import TrainConfig
from agents.training.environments import check_environments, layout_of, make_rooms
from agents.training.evaluation import Evaluation
from agents.training.ppo.learner import level_of, make_model, make_policy, run_interval
from agents.training.progress import Progress
from agents.training.run_folder import RunFolder, restore, tensors_of
from relpos_env.errors import EnvError


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainResult:
    """A finished run."""

    folder: Path
    config: TrainConfig
    progress: Progress

    @property
    def records(self) -> list[dict[str, Any]]:
        """Records of all evaluation intervals."""
        return self.progress.log


def train(
    config: TrainConfig | None,
    folder: Path,
    *,
    progress: Callable[[float, dict[str, Any] | None], None] | None = None,
) -> TrainResult:
    """Train a policy, or resume a run.

    Args:
        config: Configuration of a new run; None to resume the run in the folder.
        folder: New or empty folder, or that of the run to resume.
        progress: Called with the completed share and the record of an interval after it, else None.

    Raises:
        UsageError: The folder is unsuitable or not writable, or the training diverged.
        EnvError: An environment is invalid.
    """
    run = RunFolder(folder)
    resumed = config is None
    config = run.config() if config is None else config
    every = check_environments(config)
    if not resumed:
        if config.begin:
            begin_with(make_policy(config), config)
        run.create(config)
    tensors, state = run.load() or (None, Progress())
    torch.set_num_threads(config.threads)
    evaluation = Evaluation(every, layout_of(config), config.eval_episodes, config.threads)
    with run.writing():
        logger = Logger(None, [TensorBoardOutputFormat(str(folder / "tensorboard"))])
    learner: _Learner | None = None

    def tell(frames: int) -> None:
        if progress is not None:
            progress(min(frames / config.frames, 1.0), None)

    while state.frames < config.frames:
        began = time.perf_counter()
        level = level_of(config, state.frames)
        if learner is None or learner.level != level:
            learner = _Learner.begin(config, level, logger, tensors, state.frames, learner)
        with run.writing():
            try:
                run_interval(learner.model, config, state.n_intervals, tell)
            except (ValueError, EnvError) as error:
                # torch raises ValueError for distributions with NaN parameters, unless a library
                # has switched its checks off; then the actions are NaN.
                if all(bool(p.isfinite().all()) for p in learner.model.policy.parameters()):
                    raise
                raise UsageError(
                    f"{folder}: diverged in interval {state.n_intervals + 1}, its weights are no "
                    "numbers any more: expected a smaller --learning-rate or --entropy"
                ) from error
        measured = evaluation.run(learner.model.policy)
        state = state.after_interval(
            int(learner.model.num_timesteps), time.perf_counter() - began, level, measured
        )
        tensors = tensors_of(learner.model.policy, learner.model.policy.optimizer)
        run.save(tensors, state, best=state.best_interval == state.n_intervals - 1)
        with run.writing():
            _note(logger, state)
        if progress is not None:
            progress(min(state.frames / config.frames, 1.0), state.log[-1])
    evaluation.close()
    logger.close()
    if learner is not None:
        learner.model.env.close()
    return TrainResult(folder=folder, config=config, progress=state)


@dataclass(frozen=True, slots=True)
class _Learner:
    """The learner and the level of its environments."""

    model: PPO
    level: int | None

    @classmethod
    def begin(
        cls,
        config: TrainConfig,
        level: int | None,
        logger: Logger,
        tensors: Mapping[str, Tensor] | None,
        frames: int,
        before: _Learner | None,
    ) -> _Learner:
        """Create a learner in the environments of a level, with the weights of a checkpoint."""
        if before is not None:
            before.model.env.close()
        model = make_model(config, make_rooms(config, level))
        model.set_logger(logger)
        model.num_timesteps = frames
        if tensors is not None:
            restore(model.policy, model.policy.optimizer, tensors)
        elif config.begin:
            begin_with(model.policy, config)
        return cls(model, level)


def _note(logger: Logger, state: Progress) -> None:
    """Write the last record to TensorBoard."""
    row = state.log[-1]
    for name in ("return", "formation_error", "tracking_error", "collisions_per_min"):
        if row[name] is not None:
            logger.record(f"evaluation/{name}", row[name])
    logger.record("time/frames_per_second", state.frames / max(state.seconds, 1e-9))
    logger.dump(state.frames)
