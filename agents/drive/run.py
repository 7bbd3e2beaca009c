"""A drive with real cars, from opened ports to cars that stand again."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np

from agents.compare.contender import find_entry
from agents.drive.result import DriveResult
from agents.driver import Driver
from agents.errors import UsageError
from hardware_bridge.config import SwarmConfig, read_config
from hardware_bridge.live.bridge import Bridge
from hardware_bridge.live.env import LiveFormationEnv
from hardware_bridge.live.opened import OpenBridge
from relpos_env.timing import DECISION
from tracking.arrays import F64, Bool

CONTROLLER = "consensus"
Watch: TypeAlias = Callable[[OpenBridge, LiveFormationEnv], None]
STOPPED = " stopped: "
MOST_CYCLES = 800_000


def drive(
    *,
    config: SwarmConfig | Path | str,
    name: str = CONTROLLER,
    observation: str | None = None,
    arm: bool = False,
    seconds: float | None = None,
    wait: float = 60.0,
    record: Path | str | None = None,
    watch: Watch | None = None,
    attend: Callable[[Callable[[str], None]], None] | None = None,
) -> DriveResult:
    """Drive the cars of a swarm on the estimates of their trackers.

    Args:
        config: A swarm.toml, or what `read_config` made of one.
        name: A controller of `agents.controllers.CONTROLLERS`, or a policy as for
            `agents.policy.load_policy`.
        observation: What they see; by default what the policy was trained on, or `estimate`.
        arm: Whether the cars may move: they are armed once all has been well for a while. Without
            it is a dry run, and no port of a car is opened.
        seconds: Length from then on; None ends with Ctrl-C or when the task is done.
        wait: So long is waited for all to be well [s].
        record: File for a recording.
        watch: Called after every decision.
        attend: Called every hundredth of a second with what takes orders: ``arm``, ``disarm``,
            ``stop``, ``clear``, or ``quit``, which ends the drive.

    Raises:
        BridgeError: Something of the swarm cannot be used, or the cars could not be armed.
        UsageError: No driver of that name, or not for such cars.
    """
    swarm = config if isinstance(config, SwarmConfig) else read_config(config)
    if arm:
        with suppress(OSError, AttributeError):  # without the right to, the default has to do
            os.setpriority(os.PRIO_PROCESS, 0, -5)

    def open_bridge() -> Bridge:
        return Bridge(swarm, drive=True, arm=arm, wait=wait, record=record)

    return drive_on(
        open_bridge,
        swarm.n_slots,
        name=name,
        observation=observation,
        arm=arm,
        seconds=seconds,
        watch=watch,
        attend=attend,
    )


def drive_on(
    open_bridge: Callable[[], OpenBridge],
    n_slots: int,
    *,
    name: str = CONTROLLER,
    observation: str | None = None,
    arm: bool = True,
    seconds: float | None = None,
    watch: Watch | None = None,
    attend: Callable[[Callable[[str], None]], None] | None = None,
) -> DriveResult:
    """Drive the cars of a bridge, which is opened when all else is well, and closed again.

    Args:
        open_bridge: Opens it.
        n_slots: Slots of its swarm.
        name: As for `drive`, like all that follow.
        observation: What they see.
        arm: Whether the bridge arms the cars.
        seconds: Length.
        watch: Called after every decision.
        attend: Called with what takes orders.

    Raises:
        BridgeError: As `drive`.
        UsageError: Likewise.
    """
    entry = find_entry(name)
    if entry.proximity:
        raise UsageError(f"{name}: expected a driver without beams, real cars have none")
    seen = observation or entry.trained_on or "estimate"
    if seen == "truth":
        raise UsageError("observation: real cars know no truth, expected estimate")
    reason = entry.refusal(seen, n_slots, 0)
    if reason is not None:
        raise UsageError(f"{name}: {reason}")
    driver = entry.driver(seen, n_slots, 0)
    cycles = MOST_CYCLES if seconds is None else round(seconds / DECISION)
    with closing(open_bridge()) as bridge:
        env = bridge.env(observation=seen, history=entry.history, max_cycles=cycles)
        log = _Log(entry.title, bridge, env)
        orders = _Orders(bridge)
        if attend is not None:
            bridge.feed.attend = lambda: attend(orders.take)
        bridge.start.attend = lambda: orders.show(env, watch)
        try:
            _drive(env, driver, log, lambda: orders.show(env, watch))
        except KeyboardInterrupt:
            pass
        finally:
            bridge.feed.order("quit")
        return log.result(arm)


class _Orders:
    """What people ask for while it lasts."""

    def __init__(self, bridge: OpenBridge) -> None:
        self._bridge, self._quit = bridge, False

    def take(self, what: str) -> None:
        """An order."""
        self._quit |= what == "quit"
        self._bridge.feed.order(what)

    def show(self, env: LiveFormationEnv, watch: Watch | None) -> bool:
        """After a decision; whether it is to end."""
        if watch is not None:
            watch(self._bridge, env)
        return self._quit


def _drive(env: LiveFormationEnv, driver: Driver, log: _Log, is_over: Callable[[], bool]) -> None:
    """Decide until the time is up, the task is done, or somebody says so."""
    for space in env.observation_spaces.values():
        driver.act(np.zeros(space.shape, np.float32))  # loads what is loaded when first used
    observations, _ = env.reset()
    log.first()
    while env.agents:
        actions = {agent: driver.act(seen) for agent, seen in observations.items()}
        observations, *_ = env.step(actions)
        log.add()
        if is_over():
            return


@dataclass(slots=True)
class _Log:
    """What is kept of every decision."""

    title: str
    bridge: OpenBridge
    env: LiveFormationEnv
    n_late: int = 0
    t_ns: list[int] = field(default_factory=list)
    target: list[F64] = field(default_factory=list)
    wanted: list[Bool] = field(default_factory=list)
    error: list[float] = field(default_factory=list)
    command: list[F64] = field(default_factory=list)
    passed: list[F64] = field(default_factory=list)
    lag: list[float] = field(default_factory=list)

    def first(self) -> None:
        """The drive begins."""
        self.n_late = self.bridge.feed.n_late

    def add(self) -> None:
        """A decision has passed."""
        group, report = self.env.group, self.bridge.feed.report
        present = group.believed.present[0]
        task, n = group.task, self.bridge.config.n_slots
        self.t_ns.append(group.t_ns)
        self.target.append(task.target[0].copy())
        self.wanted.append(task.has_target[0].copy())
        self.error.append(float(task.error[0, present].mean()) if present.any() else np.nan)
        self.command.append(group.asked.copy())
        gated = (report.speed, report.steering) if report else (np.zeros(n), np.zeros(n))
        self.passed.append(np.stack(gated, axis=-1))
        self.lag.append(report.lag if report is not None and report.lag > 0.0 else np.nan)

    def result(self, armed: bool) -> DriveResult:
        """All of it."""
        n, report = self.bridge.config.n_slots, self.bridge.feed.report
        k = len(self.t_ns)
        notices = [text for _, text in self.bridge.feed.notices]
        return DriveResult(
            driver=self.title,
            armed=armed,
            t_ns=np.array(self.t_ns, dtype=np.int64),
            target=np.array(self.target).reshape(k, n, n, 2),
            wanted=np.array(self.wanted, dtype=bool).reshape(k, n, n),
            error=np.array(self.error),
            command=np.array(self.command).reshape(k, n, 2),
            passed=np.array(self.passed).reshape(k, n, 2),
            lag=np.array(self.lag),
            late_decisions=self.bridge.feed.n_late - self.n_late,
            missed_ticks=report.missed if report is not None else 0,
            stops=tuple(text for text in notices if STOPPED in text),
        )
