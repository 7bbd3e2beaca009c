"""The folder of a training run: configuration, checkpoints, best weights, records.

Weights are stored as safetensors, which contain no executable code. Every file is written under a
temporary name in the same folder, flushed and then renamed: after a kill or with a full disk the
last good file remains.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from agents.errors import UsageError
from agents.output import check_new
from agents.settings import from_json, to_json
from agents.training.config import FORMAT, TrainConfig
from agents.training.environments import layout_of
from agents.training.progress import Progress

CONFIG, LAST, BEST, LOG = "config.json", "last.safetensors", "best.safetensors", "intervals.jsonl"


class RunFolder:
    """Reads and writes one run."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def exists(self) -> bool:
        """Return whether the folder contains a run."""
        return (self.path / CONFIG).exists()

    def create(self, config: TrainConfig) -> None:
        """Begin a new run.

        Raises:
            UsageError: The folder is not new or empty, or cannot be written to.
        """
        # A process killed here before has left at most a temporary file of the configuration.
        with suppress(OSError):
            self._beside(CONFIG).unlink()
        check_new(self.path)
        record = {"format": FORMAT, "layout": layout_of(config).digest, "config": to_json(config)}
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._write(CONFIG, json.dumps(record, indent=1).encode())
        except OSError as error:
            raise UsageError(
                f"--out {self.path}: cannot be written to ({error.strerror})"
            ) from error

    def config(self) -> TrainConfig:
        """Read the configuration of the run.

        Raises:
            UsageError: The run is missing, damaged, or of another version.
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
                f"{path}: a run of format {version!r}, expected {FORMAT}; train it again"
            )
        config = from_json(TrainConfig, found.get("config"), f"{path}: config")
        if found.get("layout") != layout_of(config).digest:
            raise UsageError(
                f"{path}: a run on another observation layout than this version has; train it again"
            )
        return config

    def save(self, tensors: Mapping[str, Tensor], progress: Progress, *, best: bool) -> None:
        """Write a checkpoint, and a copy as the best weights if `best`.

        Raises:
            UsageError: The checkpoint cannot be written; the last good one remains.
        """
        data = save(dict(tensors), {"progress": json.dumps(asdict(progress))})
        lines = "".join(json.dumps(r, allow_nan=False) + "\n" for r in progress.log)
        with self.writing():
            if best:
                self._write(BEST, data)
            self._write(LAST, data)
            self._write(LOG, lines.encode())

    def load(self, name: str = LAST) -> tuple[dict[str, Tensor], Progress] | None:
        """Read tensors and progress of a checkpoint; None if there is none.

        Raises:
            UsageError: The checkpoint is damaged.
        """
        path = self.path / name
        if not path.exists():
            return None
        try:
            data = path.read_bytes()
            tensors = load(data)
            # The format begins with the length of a JSON header.
            header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
            progress = Progress.from_json(header["__metadata__"]["progress"])
        except (OSError, SafetensorError, ValueError, KeyError, TypeError) as error:
            raise UsageError(f"{path}: damaged checkpoint ({error})") from error
        return tensors, progress

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Convert write errors of a run into errors that name the option to resume it.

        Raises:
            UsageError: An OSError was raised inside.
        """
        try:
            yield
        except OSError as error:
            kept = "the last checkpoint is kept, " if (self.path / LAST).exists() else ""
            why = error.strerror or error
            raise UsageError(
                f"{error.filename or self.path}: cannot be written ({why}); {kept}go on with "
                f"--resume {self.path}"
            ) from error

    def _beside(self, name: str) -> Path:
        """Return the temporary path of a file."""
        return self.path / f".{name}.new"

    def _write(self, name: str, data: bytes) -> None:
        """Replace a file atomically.

        Raises:
            OSError: The file cannot be written; it is unchanged.
        """
        path, scratch = self.path / name, self._beside(name)
        try:
            with scratch.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            scratch.replace(path)
        except OSError as error:
            scratch.unlink(missing_ok=True)
            raise OSError(error.errno, error.strerror, str(path)) from error


def tensors_of(policy: torch.nn.Module, optimizer: torch.optim.Optimizer) -> dict[str, Tensor]:
    """Return copies of the weights and of the optimiser's state by name."""
    tensors = {f"policy.{k}": v for k, v in policy.state_dict().items()}
    for k, memory in optimizer.state_dict()["state"].items():
        tensors.update({f"optimizer.{k}.{name}": value for name, value in memory.items()})
    return {k: v.detach().clone().contiguous() for k, v in tensors.items()}


def restore(
    policy: torch.nn.Module, optimizer: torch.optim.Optimizer, tensors: Mapping[str, Tensor]
) -> None:
    """Load the weights and the optimiser's state from tensors.

    Raises:
        UsageError: The tensors belong to other networks or another optimiser.
    """
    restore_weights(policy, tensors)
    memory: dict[int, dict[str, Tensor]] = {}
    groups = optimizer.state_dict()["param_groups"]
    try:
        for name, value in tensors.items():
            if name.startswith("optimizer."):
                _, k, entry = name.split(".")
                memory.setdefault(int(k), {})[entry] = value
        optimizer.load_state_dict({"state": memory, "param_groups": groups})
    except (RuntimeError, ValueError, KeyError) as error:
        raise UsageError(f"checkpoint: of another optimiser ({error})") from error


def restore_weights(policy: torch.nn.Module, tensors: Mapping[str, Tensor]) -> None:
    """Load the weights from tensors.

    Raises:
        UsageError: The tensors belong to other networks.
    """
    own = {k.removeprefix("policy."): v for k, v in tensors.items() if k.startswith("policy.")}
    try:
        policy.load_state_dict(own)
    except RuntimeError as error:
        raise UsageError(
            f"checkpoint: of other networks than the configuration's ({error})"
        ) from error
