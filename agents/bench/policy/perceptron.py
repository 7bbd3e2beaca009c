"""A multilayer perceptron of usual size, as a policy and in numpy."""

from __future__ import annotations

import hashlib

import numpy as np

from agents.errors import UsageError
from agents.policies.card import Card
from agents.policies.layout import Layout
from agents.policies.trained import TrainedPolicy, check_policy
from relpos_env.interface.observations.base import F32

HIDDEN = (64, 64)
"""[-] Hidden layer sizes, the default of Stable-Baselines3."""
SCALE = 0.1
"""[-] Standard deviation of the weights, small enough that actions do not saturate."""


class Perceptron:
    """Peer in numpy: normalised observations and layers with tanh, including the output."""

    def __init__(self, layout: Layout, seed: int = 0) -> None:
        """Sample random weights.

        Args:
            layout: Layout of the observations.
            seed: Seed of the weights.
        """
        rng = np.random.default_rng(seed)
        widths = (layout.size, *HIDDEN, 2)
        self.layout = layout
        self.mean = rng.normal(0.0, 0.1, layout.size).astype(np.float32)
        self.std = rng.uniform(0.5, 2.0, layout.size).astype(np.float32)
        self.layers = [
            (
                rng.normal(0.0, SCALE, (before, after)).astype(np.float32),
                rng.normal(0.0, SCALE, after).astype(np.float32),
            )
            for before, after in zip(widths[:-1], widths[1:], strict=True)
        ]

    def act(self, observations: F32) -> F32:
        """Return actions, (..., 2); see `Driver`."""
        x: F32 = (observations - self.mean) / self.std
        for weight, bias in self.layers:
            x = np.tanh(x @ weight + bias)
        return x

    def policy(self) -> TrainedPolicy:
        """Return the same network as a loaded policy.

        Raises:
            UsageError: onnx is not installed.
        """
        data = self._onnx()
        card = Card(
            name="bench",
            layout=self.layout,
            onnx_sha256=hashlib.sha256(data).hexdigest(),
            training={},
        )
        return TrainedPolicy(check_policy(data, card, "bench"), card)

    def _onnx(self) -> bytes:
        """Return the network as a serialised ONNX model."""
        try:
            from onnx import TensorProto, helper, numpy_helper
        except ImportError:
            raise UsageError(
                "bench: onnx is not installed, expected the development tools: "
                ".venv/bin/pip install -e '.[dev]' -c constraints.txt"
            ) from None
        arrays = {"mean": self.mean, "std": self.std}
        nodes = [
            helper.make_node("Sub", ["observations", "mean"], ["centred"]),
            helper.make_node("Div", ["centred", "std"], ["h0"]),
        ]
        for k, (weight, bias) in enumerate(self.layers):
            arrays |= {f"w{k}": weight, f"b{k}": bias}
            out = "actions" if k == len(self.layers) - 1 else f"h{k + 1}"
            nodes += [
                helper.make_node("Gemm", [f"h{k}", f"w{k}", f"b{k}"], [f"g{k}"]),
                helper.make_node("Tanh", [f"g{k}"], [out]),
            ]
        one = TensorProto.FLOAT
        graph = helper.make_graph(
            nodes,
            "perceptron",
            [helper.make_tensor_value_info("observations", one, ["batch", self.layout.size])],
            [helper.make_tensor_value_info("actions", one, ["batch", 2])],
            [numpy_helper.from_array(array, name) for name, array in arrays.items()],
        )
        # Versions that the oldest supported onnxruntime can read.
        opsets = [helper.make_opsetid("", 17)]
        model = helper.make_model(graph, opset_imports=opsets, ir_version=8)
        return bytes(model.SerializeToString())
