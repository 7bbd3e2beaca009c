"""What an engine is: it does the same work on many tasks, somewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

Result = TypeVar("Result")


class Engine(Protocol):
    """Shares work out.

    Law: results are those of calling the function on one task after the other, whatever the
    engine and the number of jobs; only their order may differ.
    """

    def __call__(
        self, function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], jobs: int
    ) -> Iterator[tuple[int, Result]]:
        """Call a function with the arguments of every task.

        Args:
            function: Of a module, so that other processes find it by its name.
            tasks: Positional arguments of each call; they and the results can be pickled.
            jobs: Calls at a time, at least 1.

        Returns:
            Number of the task and what came of it, in any order, as they come.

        Raises:
            UsageError: A worker was lost.
        """
