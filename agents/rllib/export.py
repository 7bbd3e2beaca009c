"""Export of a trained RLlib module to a policy that runs without RLlib and torch."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper
from torch import nn

from agents.policies.card import Card
from agents.policies.layout import Layout
from agents.policies.write import write_policy
from agents.rllib.module import LIMIT, N_ACTIONS, CarModule

OPSET, IR = 17, 8
"""Versions of ONNX that all supported onnxruntime versions read."""


def export_module(
    module: CarModule, layout: Layout, folder: Path, name: str, training: Mapping[str, Any]
) -> Path:
    """Write the actor as ``name.onnx`` and its card as ``name.json``.

    Args:
        module: Module, trained or not.
        layout: Layout of its observations.
        folder: Output folder.
        name: Name of the policy.
        training: Record of the training for the card.

    Returns:
        Path of the network's file.

    Raises:
        PolicyError: The module is not a valid policy, for example with weights that are not finite.
        UsageError: The folder cannot be written to.
    """
    card = Card(name=name, layout=layout, training=dict(training))
    write_policy(folder, name, to_onnx(module, layout.size), card)
    return folder / f"{name}.onnx"


def to_onnx(module: CarModule, size: int) -> bytes:
    """Return the actor as an ONNX graph from `observations` (batch, size) to `actions` (batch, 2).

    Actions are the mean of the distribution, clipped as by RLlib's connector.

    Args:
        module: Module with the actor.
        size: Length of an observation.
    """
    constants: dict[str, Any] = {
        "gain": _array(module.gain),
        "limit": np.float32(LIMIT),
        "minus_limit": np.float32(-LIMIT),
        "one": np.float32(1.0),
        "minus_one": np.float32(-1.0),
    }
    nodes = [
        helper.make_node("Mul", ["observations", "gain"], ["scaled"]),
        helper.make_node("Clip", ["scaled", "minus_limit", "limit"], ["x"]),
    ]
    last = "x"
    for k, layer in enumerate(module.actor):
        out = f"x{k}"
        if isinstance(layer, nn.Linear):
            constants[f"w{k}"], constants[f"b{k}"] = _array(layer.weight), _array(layer.bias)
            nodes.append(helper.make_node("Gemm", [last, f"w{k}", f"b{k}"], [out], transB=1))
        else:
            nodes.append(helper.make_node("Tanh", [last], [out]))
        last = out
    nodes.append(helper.make_node("Clip", [last, "minus_one", "one"], ["actions"]))
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("observations", TensorProto.FLOAT, ["batch", size])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, ["batch", N_ACTIONS])],
        [numpy_helper.from_array(np.asarray(a), name) for name, a in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR)
    onnx.checker.check_model(model)
    data: bytes = model.SerializeToString()
    return data


def _array(tensor: Any) -> Any:
    return tensor.detach().cpu().numpy()
