"""Validation of an ONNX network before any library opens it.

ONNX files can refer to external data files, which the runtime then reads (measured: from the
working folder even if the model is given as bytes), and contain operators of other domains, loops
and functions. A policy needs only a plain sequence of standard operators; all other content, known
or unknown, is refused.

Field numbers are those of the schema [1].

References:
    [1] https://github.com/onnx/onnx/blob/main/onnx/onnx.proto
"""

from __future__ import annotations

from dataclasses import dataclass, field

from agents.policies.errors import PolicyError
from agents.policies.protobuf import BYTES, VARINT, Budget, WireError, fields

OPERATORS = {
    "Abs", "Add", "And", "Cast", "Ceil", "Clip", "Concat", "Constant", "Div", "Elu", "Equal",
    "Erf", "Exp", "Expand", "Flatten", "Floor", "Gather", "GatherElements", "Gelu", "Gemm",
    "Greater", "GreaterOrEqual", "HardSigmoid", "Identity", "IsNaN", "LayerNormalization",
    "LeakyRelu", "Less", "LessOrEqual", "Log", "MatMul", "Max", "Min", "Mod", "Mul", "Neg", "Not",
    "Or", "Pow", "Reciprocal", "ReduceL2", "ReduceMax", "ReduceMean", "ReduceMin", "ReduceProd",
    "ReduceSum", "Relu", "Reshape", "Round", "Selu", "Shape", "Sigmoid", "Sign", "Slice",
    "Softmax", "Softplus", "Split", "Sqrt", "Squeeze", "Sub", "Sum", "Tanh", "Transpose",
    "Unsqueeze", "Where",
}  # fmt: skip
"""Permitted operators: none with loops, random numbers or state."""
DOMAINS = ("", "ai.onnx")
MOST_FIELDS = 200_000
"""[-] Maximum number of fields of a file; a policy has a few hundred."""


@dataclass(frozen=True, slots=True)
class Schema:
    """Permitted fields of a message."""

    name: str
    parts: dict[int, Schema] = field(default_factory=dict)
    """Fields that are messages and are checked recursively."""
    plain: tuple[int, ...] = ()
    """Fields with arbitrary content."""
    refused: dict[int, str] = field(default_factory=dict)
    """Refused fields, with their meaning."""
    zero: dict[int, str] = field(default_factory=dict)
    """Fields that must be 0, with the meaning of other values."""
    domain: int | None = None
    """Field with the name of a domain."""
    operator: int | None = None
    """Field with the name of an operator."""


TENSOR = Schema(
    "tensor",
    plain=(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 16),
    refused={13: "data in another file"},
    zero={14: "data in another file"},
)
ATTRIBUTE = Schema(
    "attribute",
    parts={5: TENSOR, 10: TENSOR},
    plain=(1, 2, 3, 4, 7, 8, 9, 13, 20),
    refused={
        6: "a graph inside an operator",
        11: "a graph inside an operator",
        14: "a type",
        15: "a type",
        21: "a reference to a function",
        22: "a sparse tensor",
        23: "a sparse tensor",
    },
)
NODE = Schema(
    "operator",
    parts={5: ATTRIBUTE},
    plain=(1, 2, 3, 6, 9),
    refused={8: "an overloaded function", 10: "devices"},
    domain=7,
    operator=4,
)
GRAPH = Schema(
    "graph",
    parts={1: NODE, 5: TENSOR},
    plain=(2, 10, 11, 12, 13, 16),
    refused={14: "quantisation", 15: "a sparse tensor"},
)
OPSET = Schema("set of operators", plain=(2,), domain=1)
MODEL = Schema(
    "model",
    parts={7: GRAPH, 8: OPSET},
    plain=(1, 2, 3, 4, 5, 6, 14),
    refused={20: "training", 25: "functions of its own", 26: "devices"},
)


def check_graph(data: bytes, where: str) -> None:
    """Check that a file is a self-contained ONNX network of standard operators.

    Args:
        data: Content of the file.
        where: Name of the file in errors.

    Raises:
        PolicyError: The file is not such a network.
    """
    if data[:1] == b"\x80" or data[:2] == b"PK":
        kind = "a pickle" if data[:1] == b"\x80" else "a zip archive"
        raise PolicyError(
            where, f"is {kind} and no ONNX file; such a file may execute code when it is loaded"
        )
    try:
        _check(memoryview(data), MODEL, Budget(MOST_FIELDS), where)
    except WireError as error:
        raise PolicyError(where, f"is no ONNX file, or a damaged one: {error}") from error


def _check(message: memoryview, schema: Schema, budget: Budget, where: str) -> None:
    for number, wire, value in fields(message, budget):
        if number in schema.refused:
            raise PolicyError(where, f"{schema.refused[number]}: not allowed in a policy")
        if number in schema.zero:
            if wire != VARINT or value != 0:
                raise PolicyError(where, f"{schema.zero[number]}: not allowed in a policy")
        elif number in schema.parts:
            if wire != BYTES or not isinstance(value, memoryview):
                raise WireError(f"a {schema.parts[number].name} of wire type {wire}")
            _check(value, schema.parts[number], budget, where)
        elif number in (schema.domain, schema.operator):
            _check_name(value, number == schema.domain, where)
        elif number not in schema.plain:
            raise PolicyError(where, f"field {number} of a {schema.name}: unknown")


def _check_name(value: int | memoryview, is_domain: bool, where: str) -> None:
    """Check that the name of a domain or an operator is permitted."""
    if not isinstance(value, memoryview):
        raise WireError("a name that is a number")
    try:
        name = bytes(value[:200]).decode("utf-8")
    except UnicodeDecodeError as error:
        raise WireError("a name that is no text") from error
    if is_domain and name not in DOMAINS:
        raise PolicyError(where, f"operators of domain {name[:60]!a}: expected standard ones only")
    if not is_domain and name not in OPERATORS:
        raise PolicyError(
            where, f"operator {name[:60]!a}: not among those that a policy is made of"
        )
