"""Initialisation of a run with the network of a policy."""

from __future__ import annotations

import numpy as np
import onnx
import torch
from onnx import numpy_helper

from agents.errors import UsageError
from agents.policies.find import MOST_NETWORK, find_policy, read_bounded
from agents.policies.trained import load_policy
from agents.training.config import TrainConfig
from agents.training.environments import layout_of
from agents.training.export import to_onnx
from agents.training.ppo.network import Actor, SwarmPolicy
from relpos_env.interface.observations.base import F32


def begin_with(policy: SwarmPolicy, config: TrainConfig) -> None:
    """Copy the weights of the policy `config.begin` into the actor; the critic is left unchanged.

    The ONNX exporter folds, transposes and renames weights. An actor with random weights is
    therefore exported as well, and each weight is matched by its values in that network.

    Raises:
        PolicyError: The policy does not exist or is damaged.
        UsageError: Its observation layout or the shape of its network differs.
    """
    layout = layout_of(config)
    if load_policy(config.begin).layout.digest != layout.digest:
        raise UsageError(
            f"--begin {config.begin}: it sees other numbers than cars of this run, expected its "
            "--task, --observation, --history, --proximity and --cars"
        )
    network_file, _ = find_policy(config.begin)
    actor = Actor(policy)
    with torch.no_grad():
        for weight in actor.parameters():
            weight.uniform_()  # distinguishes biases, which are initialised with zeros
    given = _arrays(read_bounded(network_file, MOST_NETWORK))
    ours = _arrays(to_onnx(actor, layout.size))
    if {k: a.shape for k, a in ours.items()} != {k: a.shape for k, a in given.items()}:
        raise UsageError(
            f"--begin {config.begin}: a network of another shape, expected its --width, --depth "
            "and --layers"
        )
    with torch.no_grad():
        for weight in actor.parameters():
            weight.copy_(_counterpart(weight, ours, given, config.begin))


def _arrays(network: bytes) -> dict[str, F32]:
    """Return the constants of a network by name."""
    graph = onnx.load_from_string(network).graph
    return {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}


def _counterpart(
    weight: torch.Tensor, ours: dict[str, F32], given: dict[str, F32], policy: str
) -> torch.Tensor:
    """Return the given weight that corresponds to a weight of our actor."""
    own = weight.detach().numpy()
    for name, array in ours.items():
        if np.array_equal(array, own):
            return torch.tensor(given[name])
        if np.array_equal(array.T, own):
            return torch.tensor(given[name].T)
    raise UsageError(f"--begin {policy}: written by another exporter, expected one of this version")
