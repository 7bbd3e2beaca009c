"""Small networks and cards for the tests of policies."""

import hashlib
from dataclasses import replace

import numpy as np
from onnx import TensorProto, helper, numpy_helper

from agents.policies.card import Card
from agents.policies.layout import Layout

LAYOUT = Layout("estimate", 3)


def node(kind, inputs, outputs, **attributes):
    return helper.make_node(kind, inputs, outputs, **attributes)


def perceptron(size=LAYOUT.size, hidden=(8,), seed=0, scale=0.3):
    """Layers with tanh: nodes and arrays."""
    rng = np.random.default_rng(seed)
    widths = [size, *hidden, 2]
    nodes, arrays, x = [], {}, "observations"
    for k, (before, after) in enumerate(zip(widths[:-1], widths[1:], strict=True)):
        arrays[f"w{k}"] = rng.normal(0.0, scale, (before, after)).astype(np.float32)
        arrays[f"b{k}"] = rng.normal(0.0, scale, after).astype(np.float32)
        y = "actions" if after is widths[-1] and k == len(widths) - 2 else f"h{k}"
        nodes += [node("Gemm", [x, f"w{k}", f"b{k}"], [f"g{k}"]), node("Tanh", [f"g{k}"], [y])]
        x = y
    return nodes, arrays


def forward(arrays, observations):
    """Evaluate the same network in numpy."""
    x = observations
    for k in range(len(arrays) // 2):
        x = np.tanh(x @ arrays[f"w{k}"] + arrays[f"b{k}"])
    return x


def model(
    nodes,
    arrays,
    *,
    size=LAYOUT.size,
    batch="batch",
    n_actions=2,
    names=None,
    domains=(),
    kind=None,
):
    """Build an ONNX model of nodes and constants."""
    kind = TensorProto.FLOAT if kind is None else kind
    first, last = names or ("observations", "actions")
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info(first, kind, [batch, size])],
        [helper.make_tensor_value_info(last, kind, [batch, n_actions])],
        [numpy_helper.from_array(a, name) for name, a in arrays.items()],
    )
    opsets = [helper.make_opsetid("", 17), *(helper.make_opsetid(d, 1) for d in domains)]
    return helper.make_model(graph, opset_imports=opsets, ir_version=8)


def good_model(**changes):
    return model(*perceptron(**changes), size=changes.get("size", LAYOUT.size))


def card_of(data, **changes):
    """Return a card that matches the bytes of a network."""
    card = Card(name="test", layout=LAYOUT, training={"seed": 1}, results=({"error": 0.1},))
    return replace(card, onnx_sha256=hashlib.sha256(data).hexdigest(), **changes)


def put(folder, data, card=None, name="test"):
    """Write the two files, unchecked."""
    (folder / f"{name}.onnx").write_bytes(data)
    text = card if isinstance(card, str) else (card or card_of(data)).to_json()
    (folder / f"{name}.json").write_text(text)
    return folder / f"{name}.onnx"
