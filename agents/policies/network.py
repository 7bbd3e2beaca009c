"""Inference of a network by onnxruntime on one core."""

from __future__ import annotations

import os
from functools import cache
from typing import NamedTuple

# Otherwise onnxruntime sends telemetry and stores an identifier in the home folder.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")

import onnxruntime  # noqa: E402

from agents.policies.errors import PolicyError  # noqa: E402
from agents.policies.graph import check_graph  # noqa: E402
from agents.policies.patience import Patience  # noqa: E402
from relpos_env.interface.observations.base import F32  # noqa: E402

INPUT, OUTPUT = "observations", "actions"
N_ACTIONS = 2
MOST_MEMORY = 128 << 20
"""[byte] Memory limit of all networks of a process, since a small file can request any amount. Runs
end only between two operators: one matrix product of this size takes about 3 s."""
PATIENCE = Patience(1.0)
"""Time limit of a run. Shipped policies need about 40 us per step, see `relpos bench policy`."""
SILENT = 4
"""Log level of onnxruntime without messages: errors are reported once, as `PolicyError`."""


class End(NamedTuple):
    """Input or output of a graph."""

    name: str
    kind: str
    shape: tuple[int | str | None, ...]


class Network:
    """An ONNX graph from observations to actions."""

    def __init__(self, data: bytes, size: int, where: str) -> None:
        """Open a graph.

        Args:
            data: Content of the file.
            size: Length of an observation.
            where: Name of the file in errors.

        Raises:
            PolicyError: Not a plain ONNX network from (batch, size) to (batch, 2).
        """
        check_graph(data, where)
        _bound_memory()
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
        # Constant folding while the file is opened would have no limits.
        options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
        options.log_severity_level = SILENT
        options.add_session_config_entry("session.use_env_allocators", "1")
        # The file was checked as ONNX, and must not be loaded in another format.
        options.add_session_config_entry("session.load_model_format", "ONNX")
        try:
            # The fallback would print and try the same again.
            self._session = onnxruntime.InferenceSession(
                data, options, providers=["CPUExecutionProvider"], enable_fallback=0
            )
            # These may fail too: names in a damaged file need not be text.
            inputs = [End(e.name, e.type, tuple(e.shape)) for e in self._session.get_inputs()]
            outputs = [End(e.name, e.type, tuple(e.shape)) for e in self._session.get_outputs()]
        except Exception as error:  # onnxruntime has no common class for its errors
            raise PolicyError(where, f"onnxruntime refuses it: {_first_line(error)}") from error
        self._where = where
        _check_end(inputs, INPUT, size, where)
        _check_end(outputs, OUTPUT, N_ACTIONS, where)
        self._names = [OUTPUT]

    def __call__(self, observations: F32) -> F32:
        """Return the actions, (batch, 2).

        Args:
            observations: Observations, (batch, size), contiguous.

        Raises:
            PolicyError: onnxruntime fails, or a run takes longer than `PATIENCE`.
        """
        run = onnxruntime.RunOptions()
        try:
            with PATIENCE.over(run):
                (actions,) = self._session.run(self._names, {INPUT: observations}, run)
        except Exception as error:
            if run.terminate:
                why = f"a step takes longer than {PATIENCE.seconds:g} s"
                raise PolicyError(self._where, why) from error
            raise PolicyError(self._where, f"cannot be run: {_first_line(error)}") from error
        return actions  # type: ignore[no-any-return]


@cache
def _bound_memory() -> None:
    """Register one allocator with a memory limit for all networks."""
    onnxruntime.set_default_logger_severity(SILENT)
    kind, use = onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, onnxruntime.OrtMemType.DEFAULT
    memory = onnxruntime.OrtMemoryInfo("Cpu", kind, 0, use)
    as_requested = 1  # extend by the requested size, without doubling
    limits = {"max_mem": MOST_MEMORY, "arena_extend_strategy": as_requested}
    onnxruntime.create_and_register_allocator(memory, onnxruntime.OrtArenaCfg(limits))


def _check_end(found: list[End], name: str, size: int, where: str) -> None:
    """Check that there is one input or output, of the expected name, type and shape."""
    names = [end.name for end in found]
    if names != [name]:
        raise PolicyError(where, f"expected {name!r} alone, got {', '.join(map(ascii, names))}")
    _, kind, shape = found[0]
    if kind != "tensor(float)":
        raise PolicyError(where, f"{name}: expected tensor(float), got {kind}")
    # The first axis of a variable batch size is a name or None, not a number.
    if len(shape) != 2 or isinstance(shape[0], int) or shape[1] != size:
        shown = ", ".join(ascii(n).strip("'") for n in shape)
        raise PolicyError(where, f"{name}: expected shape (batch, {size}), got ({shown})")


def _first_line(error: Exception) -> str:
    """Return the first line of an onnxruntime error, as ASCII."""
    return ascii(str(error).splitlines()[0] if str(error) else type(error).__name__)[1:-1][:300]
