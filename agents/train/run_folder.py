"""The folder of a training run: configuration, checkpoints, best weights, what was measured.

Weights are stored as safetensors, numbers and their names and nothing that could be executed.
Every file is written beside its place, flushed, and only then moved there: a full disk or a kill
leaves the last good one.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from agents.errors import UsageError
from agents.output import check_new
from agents.settings import from_json, to_json
from agents.train.config import FORMAT, TrainConfig

CONFIG, LAST, BEST, LOG = "config.json", "last.safetensors", "best.safetensors", "legs.jsonl"


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """Where a run stands after a leg."""

    log: list[dict[str, Any]] = field(default_factory=list)
    """What was measured after every leg."""

    @property
    def legs(self) -> int:
        """Finished."""
        return len(self.log)

    @property
    def frames(self) -> int:
        """Decisions of cars so far."""
        return int(self.log[-1]["frames"]) if self.log else 0

    @property
    def seconds(self) -> float:
        """Spent on training so far [s]."""
        return float(self.log[-1]["seconds"]) if self.log else 0.0

    @property
    def best_leg(self) -> int:
        """The leg after which the weights with the highest return were there, the first of equals.

        Raises:
            ValueError: No leg is finished.
        """
        return max(range(self.legs), key=lambda k: float(self.log[k]["return"]))

    def after_leg(
        self, frames: int, seconds: float, level: int | None, measured: Mapping[str, Any]
    ) -> Progress:
        """Where it stands a leg later.

        Args:
            frames: So far.
            seconds: That the leg took [s].
            level: Of the curriculum in it.
            measured: Of the policy after it, see `agents.train.evaluation`.
        """
        spent = round(self.seconds + seconds, 2)
        row = {"leg": self.legs, "frames": frames, "seconds": spent, "level": level}
        return Progress(log=[*self.log, {**row, **measured}])


class RunFolder:
    """Reads and writes one run."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def exists(self) -> bool:
        """Whether a run has begun here."""
        return (self.path / CONFIG).exists()

    def create(self, config: TrainConfig) -> None:
        """Begin a new run.

        Raises:
            UsageError: The folder is not new or empty, or cannot be written to.
        """
        check_new(self.path)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError(
                f"--out {self.path}: cannot be written to ({error.strerror})"
            ) from error
        text = json.dumps({"format": FORMAT, "config": to_json(config)}, indent=1)
        self._write(CONFIG, text.encode())

    def config(self) -> TrainConfig:
        """The configuration of the run.

        Raises:
            UsageError: No run, one of another version, or a damaged one.
        """
        path = self.path / CONFIG
        try:
            found = json.loads(path.read_text())
        except OSError as error:
            raise UsageError(f"{self.path}: no training run ({error.strerror})") from error
        except ValueError as error:
            raise UsageError(f"{path}: damaged, expected JSON ({error})") from error
        version = found.get("format") if isinstance(found, dict) else None
        if version != FORMAT:
            raise UsageError(
                f"{path}: a run of format {version!r}, expected {FORMAT}; train it anew"
            )
        return from_json(TrainConfig, found.get("config"), f"{path}: config")

    def save(self, tensors: Mapping[str, Tensor], progress: Progress, *, best: bool) -> None:
        """Keep a checkpoint, and as the best weights if they are.

        Raises:
            UsageError: It cannot be written; the last good one is still there.
        """
        data = save(dict(tensors), {"progress": json.dumps(asdict(progress))})
        if best:
            self._write(BEST, data)
        self._write(LAST, data)
        lines = "".join(json.dumps(r, allow_nan=False) + "\n" for r in progress.log)
        self._write(LOG, lines.encode())

    def load(self, name: str = LAST) -> tuple[dict[str, Tensor], Progress] | None:
        """Tensors and progress of a checkpoint; None where there is none yet.

        Raises:
            UsageError: It is damaged.
        """
        path = self.path / name
        if not path.exists():
            return None
        try:
            data = path.read_bytes()
            tensors = load(data)
            # The format begins with the length of a JSON header.
            header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
            progress = Progress(**json.loads(header["__metadata__"]["progress"]))
        except (OSError, SafetensorError, ValueError, KeyError, TypeError) as error:
            raise UsageError(f"{path}: damaged checkpoint ({error})") from error
        return tensors, progress

    def _write(self, name: str, data: bytes) -> None:
        path, scratch = self.path / name, self.path / f".{name}.new"
        try:
            with scratch.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            scratch.replace(path)
        except OSError as error:
            scratch.unlink(missing_ok=True)
            raise UsageError(
                f"{path}: cannot be written ({error.strerror}); the last checkpoint is kept, "
                f"go on from it with --resume {self.path}"
            ) from error


def tensors_of(policy: torch.nn.Module, optimizer: torch.optim.Optimizer) -> dict[str, Tensor]:
    """Weights and the optimiser's memory by name."""
    tensors = {f"policy.{k}": v for k, v in policy.state_dict().items()}
    for k, memory in optimizer.state_dict()["state"].items():
        tensors.update({f"optimizer.{k}.{name}": value for name, value in memory.items()})
    return {k: v.detach().clone().contiguous() for k, v in tensors.items()}


def restore(
    policy: torch.nn.Module, optimizer: torch.optim.Optimizer, tensors: Mapping[str, Tensor]
) -> None:
    """Put weights and the optimiser's memory back.

    Raises:
        UsageError: They belong to other networks.
    """
    restore_weights(policy, tensors)
    memory: dict[int, dict[str, Tensor]] = {}
    for name, value in tensors.items():
        if name.startswith("optimizer."):
            _, k, entry = name.split(".")
            memory.setdefault(int(k), {})[entry] = value
    groups = optimizer.state_dict()["param_groups"]
    try:
        optimizer.load_state_dict({"state": memory, "param_groups": groups})
    except (RuntimeError, ValueError, KeyError) as error:
        raise UsageError(f"checkpoint: of another optimiser ({error})") from error


def restore_weights(policy: torch.nn.Module, tensors: Mapping[str, Tensor]) -> None:
    """Put weights back.

    Raises:
        UsageError: They belong to other networks.
    """
    own = {k.removeprefix("policy."): v for k, v in tensors.items() if k.startswith("policy.")}
    try:
        policy.load_state_dict(own)
    except RuntimeError as error:
        raise UsageError(
            f"checkpoint: of other networks than the configuration's ({error})"
        ) from error
