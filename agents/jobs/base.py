"""Interface of engines, which run a function on many tasks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

Result = TypeVar("Result")


class Engine(Protocol):
    """Function that runs tasks in parallel.

    Property: results are equal to those of sequential calls for any engine and number of jobs; only
    their order may differ.
    """

    def __call__(
        self, function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], jobs: int
    ) -> Iterator[tuple[int, Result]]:
        """Call a function with the arguments of every task.

        Args:
            function: Function of a module, so that other processes can import it.
            tasks: Positional arguments of each call; arguments and results must be picklable.
            jobs: Number of simultaneous calls, at least 1.

        Returns:
            Index and result of each task, in order of completion.

        Raises:
            UsageError: A worker was lost.
        """
