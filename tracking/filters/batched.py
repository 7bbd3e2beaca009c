"""Base class of filters over a batch of groups: the state is arrays with a leading env axis."""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np

from tracking.arrays import F64
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.kernels.jit import Call, bind
from tracking.measurements import MeasurementBlock


class BatchedFilter(ABC):
    """A `Filter` whose state is a tuple of arrays, (env, ...).

    Among them are the records ``nodes``, ``pairs`` and ``group`` and the states ``x``.
    """

    follows_bias: bool
    kernel: ClassVar[Callable[..., Any]]
    """Kernel that processes the events, called with the result of `_arguments`."""

    def __init__(self, constellation: Constellation, state: Any, blank: Any) -> None:
        """Store the arrays.

        Args:
            constellation: The nodes.
            state: State of all environments.
            blank: State of one environment before any measurement, arrays (1, ...).
        """
        self._constellation, self._state, self._blank = constellation, state, blank

    @abstractmethod
    def _arguments(self, events: tuple[Any, ...], estimate: TeamEstimate) -> tuple[Any, ...]:
        """Return the arguments of the kernel."""

    def run(self, block: MeasurementBlock, t_out: F64) -> TeamEstimate:
        """Process the events and return the estimates at the given times; see `Filter.run`."""
        # A writable copy, as all arrays that kernels are compiled for.
        t_out = np.array(t_out, dtype=np.float64, order="C")
        estimate = TeamEstimate.empty(self._constellation, t_out)
        arguments = self._arguments(block.arrays, estimate)
        self._complete(partial(type(self).kernel, *arguments), arguments)
        return estimate

    def _complete(self, handle: Callable[[], Any], arguments: tuple[Any, ...]) -> None:
        """Call the kernel, with its arguments, until all events are processed."""
        handle()

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """Return a function that does `run` on fixed arrays; see `Filter.bind`."""
        return bind(type(self).kernel, *self._arguments(block.in_place, estimate))

    def calls(self, block: MeasurementBlock, estimate: TeamEstimate) -> list[list[Call]]:
        """Return the kernels to compile; see `Filter.calls`."""
        return [[(type(self).kernel, self._arguments(block.in_place, estimate))]]

    def reset(self, env: int) -> None:
        """Reset one environment to the state before any measurement."""
        for array, blank in zip(self._state, self._blank, strict=True):
            array[env] = blank[0]

    def part(self, envs: slice) -> Self:
        """Return the filter of some environments, which shares their memory."""
        part = copy.copy(self)
        part._state = type(self._state)._make(array[envs] for array in self._state)
        return part

    def save(self) -> Any:
        """Return a copy of the state."""
        return type(self._state)._make(array.copy() for array in self._state)

    def restore(self, saved: Any) -> None:
        """Restore the state from a saved copy."""
        for array, old in zip(self._state, saved, strict=True):
            array[...] = old

    def mean_nis(self) -> F64:
        """Return the mean NIS over all accepted ranges, (env) [-]; NaN before the first."""
        group = self._state.group[:, 0]
        n = group["nis_n"]
        mean: F64 = np.where(n > 0, group["nis_sum"] / np.maximum(n, 1), np.nan)
        return mean

    def n_rejected(self) -> F64:
        """Return the number of ranges rejected as outliers, (env)."""
        return np.asarray(self._state.pairs["n_rejected"].sum(axis=1), dtype=np.float64)
