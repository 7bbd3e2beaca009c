"""Group of real cars with the arrays of the simulation: observations, rewards, end of episode.

Rewards and errors in ``info`` are based on the estimates, since there is no ground truth.
"""

from __future__ import annotations

from functools import partial
from typing import Protocol

import numpy as np

from hardware_bridge.config.alone import TASKS_ALONE
from hardware_bridge.errors import BridgeError
from hardware_bridge.live.estimated_state import EstimatedState
from hardware_bridge.live.picture import draw_picture
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.safety.gate import reason_text
from hardware_bridge.safety.picture import Picture
from relpos_env.interface._info_kernels import write_figures
from relpos_env.interface.infos import Columns, car_columns, make_figures
from relpos_env.interface.observations import ObservationMode, total_size
from relpos_env.interface.observations.base import F32
from relpos_env.tasks import InformedTask, Reassignment, make_task, reward_weights
from relpos_env.timing import DECISION
from tracking.arrays import F64, Bool

FASTEST_COMMAND = 2.0
"""[m/s] Largest commanded velocity of a car, equal to the simulated operator's."""


class Feed(Protocol):
    """Source of chunks and destination of snapshots: ports and a supervisor, or a recording."""

    def advance(self) -> int | None:
        """Feed the swarm until the next control step is due.

        Returns:
            Time of the control step by the host's clock [ns]; None at the end of the data.
        """

    def decide(self, picture: Picture) -> None:
        """Send requested commands and estimates to the gate."""


REASSIGN_EVERY = 10
"""[-] Control steps after which a car that decides alone assigns slots again."""


class LiveGroup:
    """One environment of real cars; see `relpos_env.interface.base_parallel_env.Group`."""

    def __init__(
        self,
        swarm: LiveSwarm,
        feed: Feed,
        mode: ObservationMode,
        *,
        history: int = 1,
        max_cycles: int = 600,
    ) -> None:
        """Create the arrays.

        Args:
            swarm: Trackers of the cars.
            feed: Feed of the swarm.
            mode: Observation mode of the cars.
            history: Number of stacked observations, the newest first.
            max_cycles: Number of control steps until truncation.

        Raises:
            BridgeError: The mode needs ground truth.
        """
        if mode.needs_truth:
            raise BridgeError("observation: real cars know no truth, choose another mode")
        self.swarm, self._feed = swarm, feed
        config = swarm.config
        n = config.n_slots
        made = partial(make_task, config.task.name, n, 1, config.task.room, **config.task.options)
        self.task = made()
        self._reassignment = (
            Reassignment(made)
            if config.alone is not None and config.task.name in TASKS_ALONE
            else None
        )
        self._weights = reward_weights(config.task.name, self.task)
        self.estimated = EstimatedState(n)
        self._figures = make_figures(1, n, len(self.task.terms))
        self._command: F64 = np.zeros((1, n, 2))
        swarm.share(self.task.target, self.task.has_target, self._command)
        self._size, self._history, self._max_cycles = total_size(mode.fields), history, max_cycles
        self.observations: F32 = np.zeros((1, n, history * self._size), np.float32)
        self.rewards: F64 = np.zeros((1, n))
        self.active: Bool = np.zeros((1, n), dtype=bool)
        self.left: Bool = np.zeros((1, n), dtype=bool)
        self.terminated: Bool = np.zeros(1, dtype=bool)
        self.truncated: Bool = np.zeros(1, dtype=bool)
        self.cycles = 0
        self.asked: F64 = np.zeros((n, 2))
        """Speed [m/s] and steering [rad] of the last actions, (slot, 2)."""
        self.t_ns = 0
        """Host time of the last control step [ns]."""
        self._begun = 0
        self._armed: Bool = swarm.armed.copy()
        self.placed = False
        """True if slots were assigned with all cars' positions known."""
        self._newest: F32 = np.zeros((1, n, self._size), np.float32)
        self._mode = mode
        self._no_cars: F64 = np.zeros((1, n))

    def seed(self, env: int, rng: np.random.Generator) -> None:
        """Do nothing, since nothing is sampled."""

    def begin(self) -> None:
        """Begin an episode at the current positions of the cars."""
        self.cycles = 0
        self.placed = False
        self.active[:] = True
        self.terminated[:] = self.truncated[:] = False
        self.observations[:] = 0.0
        if self.t_ns:
            # The last request becomes outdated meanwhile, so waiting cars are stopped.
            self.stop_cars()
        self._look(first=True)

    def step(self, speed: F64, steering: F64) -> None:
        """Request speeds and steering angles and run one control step.

        Args:
            speed: Requested speed, (1, slot) [m/s].
            steering: Requested steering angle, (1, slot) [rad].
        """
        fence = self.swarm.config.safety.fence
        t = self.t_ns * 1e-9
        self.asked[:, 0], self.asked[:, 1] = speed[0], steering[0]
        self._feed.decide(draw_picture(self.swarm, t, speed[0], steering[0], fence))
        self.cycles += 1
        self._look(first=False)

    def infos(self) -> Columns:
        """Return the infos of every car; errors and rewards are based on the estimates."""
        swarm = self.swarm
        unknown = np.full((1, self.estimated.present.shape[1]), np.nan)
        write_figures(
            self.task.error, unknown, swarm.view.ok, swarm.view.pos, swarm.view.present,
            self._no_cars,
            self.task.rewards, self._weights, self.task.done, self._figures,
        )  # fmt: skip
        columns = car_columns(
            self._figures, self.task.terms, swarm.view.present, self.active, counted=False
        )
        why = [reason_text(code) for code in swarm.reasons.tolist()]
        columns |= {
            "asked_speed": self.asked[None, :, 0],
            "allowed_speed": swarm.allowed[None, :, 0],
            "allowed_steering": swarm.allowed[None, :, 1],
            "stopped": ~swarm.armed[None],
            "gate": np.array([why], dtype=object),
        }
        return columns

    def stop_cars(self) -> None:
        """Request no motion, without waiting."""
        fence, n = self.swarm.config.safety.fence, self.swarm.config.n_slots
        still = np.zeros(n)
        self._feed.decide(draw_picture(self.swarm, self.t_ns * 1e-9, still, still, fence))

    def _look(self, first: bool) -> None:
        t_ns = self._feed.advance()
        if t_ns is None:
            self.truncated[:] = True
            return
        seconds = DECISION if first else (t_ns - self.t_ns) * 1e-9
        self.t_ns = t_ns
        swarm, task, estimated = self.swarm, self.task, self.estimated
        swarm.step(t_ns)
        estimated.update(swarm.view, seconds)
        here = slice(0, 1)
        if (swarm.armed & ~self._armed).any():
            # The plan advanced while the car was stopped: it is not near its assigned slot.
            self.placed = False
        self._armed = swarm.armed.copy()
        if first or (not self.placed and estimated.complete):
            # Slots are assigned from the known positions, and once again when all are known.
            self.placed = estimated.complete
            task.reset(estimated, here)
            self._begun = self.cycles
        now = np.array([(self.cycles - self._begun) * DECISION])
        task.update(estimated, now, self._no_cars, here)
        is_due = self.placed and estimated.complete and self.cycles % REASSIGN_EVERY == 0
        if self._reassignment is not None and is_due:
            self._reassignment.repeat(task, estimated, now, self._no_cars)
        if isinstance(task, InformedTask):
            task.inform(swarm.view.cov, swarm.view.ok, here)
        self._ask()
        self.rewards[0] = np.where(estimated.present[0], task.rewards[0] @ self._weights, 0.0)
        self.terminated[:] = task.done
        self.truncated[:] = self.cycles >= self._max_cycles
        self._observe()

    def _ask(self) -> None:
        """Write the commanded velocity of the cars: the plan, plus an operator's trim."""
        requested = self.task.plan
        if self.swarm.config.task.command == "link":
            requested = requested + self.swarm.trim
        speed = np.hypot(requested[..., 0], requested[..., 1])[..., None]
        limited = requested * FASTEST_COMMAND / np.maximum(speed, FASTEST_COMMAND)
        self._command[:] = np.where(self.swarm.view.present[..., None], limited, 0.0)

    def _observe(self) -> None:
        self._mode.bind(self.swarm.view, self._newest)()
        observations, size = self.observations, self._size
        if self._history > 1:
            observations[..., size:] = observations[..., :-size].copy()
        observations[..., :size] = self._newest
        observations[~self.swarm.view.present] = 0.0
