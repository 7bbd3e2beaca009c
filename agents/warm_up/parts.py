"""Parts to compile: trackers, the simulated world, tasks, the hardware bridge.

Each part is compiled by a separate process (`python -m agents.warm_up NAME`), and shares little
code with the others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np

from agents.errors import UsageError
from tracking import Constellation, NodeConfig, Tracker
from tracking.estimate import TeamEstimate
from tracking.filters import DEFAULT_FILTER, FILTERS, filter_builder
from tracking.kernels.jit import Call, bind, is_compiled, missing_in, types_of
from tracking.measurements import MeasurementBlock

SECONDS = {"env": 38.0, "joint.0": 33.0, "ekf-mds.0": 30.0, "joint.1": 29.0, "joint.2": 18.0,
           "paper-ekf-mds.0": 16.0, "hardware": 6.0, "tasks": 6.0}  # fmt: skip
"""[s] Compile time of a part on one core of a laptop, for the progress bar."""
ORIENTATION = "orientation"
"""Part shared by trackers with any filter."""
OTHERS = 10.0
"""[s] Assumed compile time of parts that are not in the table."""
SWARM = """
[nodes.1]
[nodes.2]
[nodes.3]
[links.n1]
port = "none"
format = "relpos"
"""
"""Configuration of a swarm whose ports are never opened."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Kernels that are compiled one after the other."""

    name: str
    is_kept: Callable[[], bool]
    """Function that returns whether its code is on disk."""
    compile: Callable[[], None]
    """Function that loads its code from disk or compiles it."""
    needs_others: bool = False
    """True if it uses the code of other parts and must be compiled after them."""

    @property
    def seconds(self) -> float:
        """[s] Approximate compile time."""
        return SECONDS.get(self.name, OTHERS)


def parts_of(
    purpose: str, filters: tuple[str, ...] = (DEFAULT_FILTER,), *, in_space: bool = True
) -> list[Part]:
    """Return the parts for a purpose.

    Args:
        purpose: One of `PURPOSES`.
        filters: Filters of `tracking.filters.FILTERS`; the purpose ``all`` compiles all of them.
        in_space: Whether groups may be three-dimensional; False covers two dimensions only.

    Raises:
        ConfigError: No filter of that name.
        UsageError: No such purpose.
    """
    if purpose not in PURPOSES:
        raise UsageError(f"--for: expected one of {', '.join(PURPOSES)}, got {purpose!r}")
    names = tuple(FILTERS) if purpose == "all" else filters
    others = [OTHER_PARTS[name] for name in PURPOSES[purpose]]
    trackers = list(_tracker_parts(names, in_space))
    if others:
        # Compiling the world also compiles most of the orientation part.
        of_world = [part for part in trackers if part.name == ORIENTATION]
        late = [replace(part, needs_others=True) for part in of_world]
        trackers = [*(part for part in trackers if part.name != ORIENTATION), *late]
    return [*trackers, *others]


def _tracker_parts(filters: Iterable[str], in_space: bool) -> Iterator[Part]:
    """Yield the parts of trackers; code shared by filters is in one part only."""
    known = set[frozenset[Any]]()
    for name in dict.fromkeys(filters):
        for part_name, calls in _kernel_groups(name, in_space):
            code = frozenset((id(kernel), types_of(given)) for kernel, given in calls)
            if code not in known:
                known.add(code)
                kept, compiles = partial(_are_kept, calls), partial(_bind_all, calls)
                yield Part(name=part_name, is_kept=kept, compile=compiles)


def _kernel_groups(name: str, in_space: bool) -> Iterator[tuple[str, list[Call]]]:
    """Yield the parts of one tracker, which do not depend on the group except its dimensions."""
    filter_builder(name)
    nodes = tuple(NodeConfig(id=k) for k in range(4))
    who = Constellation(nodes=nodes, dimensions=3 if in_space else 2)
    groups = Tracker(who, filter=name).calls()
    for k, group in enumerate(groups):
        # The last group has the orientation kernels, which are the same for all filters.
        named = f"{name}.{k}" if k < len(groups) - 1 else ORIENTATION
        yield named, group


def _bind_all(calls: list[Call]) -> None:
    for kernel, given in calls:
        bind(kernel, *given)


def _are_kept(calls: list[Call]) -> bool:
    return all(is_compiled(kernel, *given) for kernel, given in calls)


class NoFilter:
    """Dummy filter, with which the world is compiled in parallel with the tracker."""

    follows_bias = False

    def __init__(self, constellation: Constellation, params: Any, n_envs: int) -> None:
        self._constellation, self._n_envs = constellation, n_envs

    def run(self, block: MeasurementBlock, t_out: Any) -> TeamEstimate:
        """Return an empty estimate."""
        return TeamEstimate.empty(self._constellation, np.array(t_out, dtype=np.float64))

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """Return a function that does not change the estimate."""
        return lambda: None

    def calls(self, block: MeasurementBlock, estimate: TeamEstimate) -> list[list[Call]]:
        """Return no kernel calls."""
        return []

    def reset(self, env: int) -> None:
        """Do nothing."""

    def part(self, envs: slice) -> Self:
        """Return this filter."""
        return self

    def save(self) -> None:
        """Do nothing."""

    def restore(self, saved: None) -> None:
        """Do nothing."""

    def mean_nis(self) -> Any:
        """Return NaN, (env)."""
        return np.full(self._n_envs, np.nan)

    def n_rejected(self) -> Any:
        """Return zeros, (env)."""
        return np.zeros(self._n_envs)


def _drive(**arguments: Any) -> None:
    from relpos_env import formation_v0

    env = formation_v0.parallel_env(**arguments)
    env.reset(seed=0)
    for _ in range(3):
        env.step({agent: np.zeros(2, dtype=np.float32) for agent in env.agents})
    env.close()


def _compile_world() -> None:
    from relpos_env.interface.observations import OBSERVATIONS

    for observation in OBSERVATIONS:
        _drive(filter=NoFilter, observation=observation, record=True)


def _compile_tasks() -> None:
    from relpos_env.tasks import TASKS

    for task in TASKS:
        _drive(filter=NoFilter, task=task, proximity=4)


def _swarm() -> Any:
    from hardware_bridge.config.read import parse_config

    return parse_config(SWARM, file="swarm.toml", folder=Path(), with_files=False)


def _compile_hardware() -> None:
    from agents.hardware.emulate.options import EmulateOptions
    from agents.hardware.emulate.warm_up import warm_up as drive_emulated_cars
    from hardware_bridge.live.warm_up import warm_up as drive_live

    drive_live(_swarm())
    drive_emulated_cars(EmulateOptions())


def _has_world() -> bool:
    import relpos_env.core.env_core  # noqa: F401

    driven = ("_step_kernels", "_result_kernels", "interface", "tasks._ring_kernels")
    return not any(missing_in(f"relpos_env.{name}") for name in driven)


def _has_tasks() -> bool:
    import relpos_env.tasks  # noqa: F401

    return not missing_in("relpos_env.tasks")


def _has_hardware() -> bool:
    import hardware_bridge.live.swarm
    import hardware_bridge.wire.codec  # noqa: F401

    return not missing_in("hardware_bridge.wire._codec_kernels")


OTHER_PARTS = {
    part.name: part
    for part in (
        Part(name="env", is_kept=_has_world, compile=_compile_world),
        Part(name="tasks", is_kept=_has_tasks, compile=_compile_tasks, needs_others=True),
        Part(name="hardware", is_kept=_has_hardware, compile=_compile_hardware, needs_others=True),
    )
}
PURPOSES: dict[str, tuple[str, ...]] = {
    "track": (),
    "env": ("env", "tasks"),
    "hardware": ("env", "hardware"),
    "all": ("env", "tasks", "hardware"),
}
"""Parts in addition to those of trackers, by purpose."""
