"""A network of the usual size, as a policy and in numpy."""

from __future__ import annotations

import hashlib

import numpy as np

from agents.errors import UsageError
from agents.policies.card import Card
from agents.policies.layout import Layout
from agents.policies.trained import TrainedPolicy, check_policy
from relpos_env.interface.observations.base import F32

HIDDEN = (64, 64)
"""[-] Widths of the layers, those of Stable-Baselines3 by default."""
SCALE = 0.1
"""[-] Standard deviation of the weights: actions are not at their limits."""


class Perceptron:
    """Normalised observations, layers with tanh, and tanh of the last as limit: the peer."""

    def __init__(self, layout: Layout, seed: int = 0) -> None:
        """Draw the weights.

        Args:
            layout: Of the observations.
            seed: Of the weights.
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
        """Actions, (..., 2); see `Driver`."""
        x: F32 = (observations - self.mean) / self.std
        for weight, bias in self.layers:
            x = np.tanh(x @ weight + bias)
        return x

    def policy(self) -> TrainedPolicy:
        """The same network as a policy that was loaded.

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
        """The network as a graph."""
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
        # Versions that the oldest supported onnxruntime reads.
        opsets = [helper.make_opsetid("", 17)]
        model = helper.make_model(graph, opset_imports=opsets, ir_version=8)
        return bytes(model.SerializeToString())
