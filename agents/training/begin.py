"""A run that begins with the network of a policy, not with random weights."""

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
    """Give the actor the weights of the policy `config.begin`; the critic keeps its own.

    An exporter folds and transposes some weights and names them as it likes. So an actor of random
    weights is exported as well: where each of its weights went, that of the policy comes from.

    Raises:
        PolicyError: There is no such policy, or it is damaged.
        UsageError: It sees something else, or its network has another shape.
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
            weight.uniform_()  # biases, which begin as zeros, can so be told apart
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
    """The constants of a network by name."""
    graph = onnx.load_from_string(network).graph
    return {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}


def _counterpart(
    weight: torch.Tensor, ours: dict[str, F32], given: dict[str, F32], policy: str
) -> torch.Tensor:
    """The given weight that stands where ours went."""
    own = weight.detach().numpy()
    for name, array in ours.items():
        if np.array_equal(array, own):
            return torch.tensor(given[name])
        if np.array_equal(array.T, own):
            return torch.tensor(given[name].T)
    raise UsageError(f"--begin {policy}: written by another exporter, expected one of this version")
