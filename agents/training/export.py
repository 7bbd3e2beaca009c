"""Export of a trained policy to files that do not need torch (`relpos export`)."""

from __future__ import annotations

import json
import logging
import platform
import shlex
import warnings
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch

from agents.errors import UsageError
from agents.policies.card import Card
from agents.policies.write import write_policy
from agents.settings import as_options, to_json
from agents.training.choice import read_choice
from agents.training.environments import layout_of
from agents.training.ppo.learner import make_policy
from agents.training.ppo.network import Actor
from agents.training.run_folder import BEST, LAST, RunFolder, restore_weights

PACKAGES = ("relpos-env", "torch", "stable-baselines3", "numpy", "numba")
"""Packages whose versions are recorded in the model card."""


def export_policy(
    run: Path,
    out: Path,
    *,
    name: str | None = None,
    results: Iterable[dict[str, Any]] = (),
    last: bool = False,
    overwrite: bool = False,
) -> Path:
    """Write a policy of a run as a network and a model card.

    Args:
        run: Folder of the run.
        out: Folder to write to.
        name: Name of the policy; by default that of the run's folder.
        results: Results of the policy for the card, as of `relpos compare`.
        last: Export the last policy of one run, not the selected one.
        overwrite: Replace a policy of the same name.

    Returns:
        The file with the network.

    Raises:
        UsageError: There is no run, no checkpoint, or a policy of the same name already, or the
            folder cannot be written to.
    """
    name = name or run.resolve().name
    file = out / f"{name}.onnx"
    if file.exists() and not overwrite:
        raise UsageError(
            f"--out {out}: {file.name} exists already, expected a new --name or --overwrite"
        )
    chosen = None if last else read_choice(run)
    folder, which = RunFolder(run), LAST if last else BEST
    asked = folder.config()
    if chosen is not None:
        folder, which = RunFolder(chosen.run), chosen.weights
    config = folder.config()
    if config.runs > 1:
        expected = "the folder of one of them" if last else "that they have ended"
        raise UsageError(f"{run}: {config.runs} runs side by side, expected {expected}")
    found = folder.load(which)
    if found is None:
        raise UsageError(f"{run}: nothing trained yet, expected {which}")
    tensors, progress = found
    # Both files were written after the evaluation of the weights in them.
    measured = progress.log[-1]
    policy = make_policy(config)
    restore_weights(policy, tensors)
    layout = layout_of(config)
    training = {
        "command": shlex.join(["relpos", "train", "--out", name, *as_options(asked)]),
        "observation": config.env.observation,
        "task": config.env.task,
        "scenario": config.env.scenarios[0],
        "seed": config.seed,
        "frames": measured["frames"],
        "interval": measured["interval"],
        "config": to_json(config),
        "measured": measured,
        "chosen_by": None if chosen is None else chosen.measured,
        "versions": {p: version(p) for p in PACKAGES} | {"python": platform.python_version()},
    }
    card = Card(name=name, layout=layout, training=training, results=tuple(results))
    write_policy(out, card.name, to_onnx(Actor(policy), layout.size), card)
    return file


def read_results(path: Path, names: Iterable[str]) -> list[dict[str, Any]]:
    """Read the summaries of a policy from the results of `relpos compare`, without episodes.

    Args:
        path: File results.jsonl of the comparison.
        names: Possible names of the policy in that file.

    Raises:
        UsageError: The file cannot be read, a line is no JSON object, or the policy is missing.
    """
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"--results {path}: cannot be read ({error})") from error
    found = []
    for k, line in enumerate(lines):
        try:
            record = json.loads(line)
        except ValueError as error:
            raise UsageError(f"--results {path}: line {k + 1} is no JSON ({error})") from error
        if not isinstance(record, dict):
            raise UsageError(f"--results {path}: line {k + 1}: expected an object")
        found.append(record)
    # Lines of single episodes have no number of episodes.
    summaries = [r for r in found if "episodes" in r]
    selected = set(names)
    ours = [r for r in summaries if r.get("policy") in selected]
    if not ours:
        drivers = ", ".join(sorted({str(r.get("policy")) for r in summaries})) or "none"
        expected = " or ".join(sorted(selected))
        raise UsageError(f"--results {path}: expected lines of {expected}, got those of {drivers}")
    return ours


def to_onnx(actor: Actor, size: int) -> bytes:
    """Return the network as ONNX: `observations` (batch, size) to `actions` (batch, 2).

    Args:
        actor: Network to be exported.
        size: Numbers in an observation.
    """
    with warnings.catch_warnings():
        # The exporter warns of its own deprecations.
        warnings.simplefilter("ignore")
        # The exporter warns of optional packages, which are not needed.
        logging.getLogger("torch.onnx._internal.exporter._registration").setLevel(logging.ERROR)
        program = torch.onnx.export(
            actor.eval(),
            (torch.zeros(2, size),),
            input_names=["observations"],
            output_names=["actions"],
            dynamic_shapes=({0: torch.export.Dim("batch", min=1, max=1 << 16)},),
            dynamo=True,
            verbose=False,
            external_data=False,
        )
    assert program is not None
    model = program.model_proto
    graph = model.graph
    # The exporter records source paths in the metadata of every part.
    for part in (
        model, graph, *graph.node, *graph.input, *graph.output, *graph.value_info,
        *graph.initializer,
    ):  # fmt: skip
        part.ClearField("metadata_props")
        part.ClearField("doc_string")
    data: bytes = model.SerializeToString()
    return data
