"""The world of the emulated devices: a swarm with task and operator, in steps of 10 ms.

Property: the same scenario, task, seed and commands give the same states as
`relpos_env.core.env_core.EnvCore`, bit for bit.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from gymnasium.utils import seeding

from relpos_env.config import Parts
from relpos_env.interface.own_events import OwnEvents
from relpos_env.scenarios.episode import Episode, draw_episode
from relpos_env.sensors.operator import Operator
from relpos_env.simulation.recorder import Recording
from relpos_env.tasks import Reassignment
from relpos_env.timing import DECISION, DT, SOON, STAND_STILL
from relpos_env.world.world import World
from tracking.arrays import F64, Bool
from tracking.measurements import MeasurementBlock

STEPS = round(DECISION / DT)
"""[-] Steps per decision, the update period of task and operator."""
AT_REST = round(STAND_STILL / DT)
"""[-] Steps in which the cars rest at first."""


class EmulatedWorld:
    """A `hardware_bridge.emulator.emulator.World`."""

    def __init__(self, parts: Parts, seed: int, *, record: bool = False) -> None:
        """Begin an episode.

        Args:
            parts: Parts of the world.
            seed: Seed of the episode, as of `FormationEnv.reset`.
            record: Whether to keep measurements and truth in `recording`.
        """
        self.parts = parts
        is_own = parts.config.trackers == "own"
        self._swarm = swarm = World(
            parts.scenario,
            parts.n_cars,
            n_steps=1,
            proximity=parts.config.proximity,
            sends_motion=is_own,
        )
        self._own: OwnEvents | None = None
        self._was_powered = np.zeros_like(swarm.powered)
        if is_own:
            inputs = swarm.block, swarm.powered, swarm.overheard
            self._own = OwnEvents(
                swarm.constellation, parts.params.orientation, *inputs, follows_bias=False
            )
        self._task = parts.make_task(1)
        self._reassignment = Reassignment(lambda: parts.make_task(1)) if is_own else None
        self._operator = Operator(parts.config.operator, parts.n_cars, 1)
        self.recording = Recording() if record else None
        self.collisions = 0
        """[-] Collisions since the release of the cars."""
        self._touched = np.zeros((1, parts.n_cars))
        self._steps = 0
        # A car that joins rests until the next decision, as in the simulation.
        self._driven = np.zeros(parts.n_cars, dtype=bool)
        # The same samples in the same order as in `EnvCore.begin`.
        rng = seeding.np_random(seed)[0].spawn(1)[0]
        seconds = STAND_STILL + DECISION * parts.config.max_cycles
        episode = draw_episode(parts.scenario, parts.n_cars, seconds, rng)
        self._swarm.begin(0, at_decisions(episode), rng.spawn(1)[0])
        self._operator_seed = rng.integers(1 << 62)

    @property
    def swarm(self) -> World:
        """True state of the swarm, a batch of one."""
        return self._swarm

    @property
    def t(self) -> float:
        """[s] Time since the start, including the initial rest."""
        return float(self._swarm.t[0])

    @property
    def at_rest(self) -> bool:
        """True during the initial rest."""
        return self._steps < AT_REST

    @property
    def just_judged(self) -> bool:
        """True if the last step updated task and operator."""
        return self._steps >= AT_REST and (self._steps - AT_REST) % STEPS == 0

    @property
    def present(self) -> Bool:
        """True for present cars, (car)."""
        present: Bool = self._swarm.state.present[0]
        return present

    @property
    def powered(self) -> Bool:
        """True for cars whose trackers have power, (car)."""
        powered: Bool = self._swarm.powered[0]
        return powered

    @property
    def command(self) -> F64:
        """[m/s] Velocity that the operator adds to the plan, (car, 2); zeros during the rest."""
        trim: F64 = self._operator.command[0] - self._task.plan[0]
        return np.where(self.present[:, None], trim, 0.0)

    @property
    def error(self) -> float:
        """[m] Formation error of the task, mean over the present cars; NaN without any."""
        return float(self._task.error[0, self.present].mean()) if self.present.any() else math.nan

    @property
    def done(self) -> bool:
        """True if the task is accomplished."""
        return bool(self._task.done[0])

    def step(self, speed: F64, steering: F64) -> MeasurementBlock:
        """Advance by 10 ms; see `hardware_bridge.emulator.emulator.World`."""
        if self._steps % STEPS == 0:
            self._driven = self.present.copy()
        block = self._swarm.step((speed * self._driven)[None], (steering * self._driven)[None])
        self._steps += 1
        if self._own is not None:
            for car in np.flatnonzero(self.powered & ~self._was_powered[0]).tolist():
                self._own.switch_on(0, car)
            self._was_powered[:] = self._swarm.powered
            self._own.step()
        if self.recording is not None:
            self.recording.add_swarm(self._swarm)
        self._touched += self._swarm.contacts
        if self._steps == AT_REST:
            self._task.reset(self._swarm.state, slice(0, 1))
            self._operator.reset(np.array([self._operator_seed], dtype=np.uint64), slice(0, 1))
        if self.just_judged:
            self._judge()
        return block

    def known(self) -> MeasurementBlock | None:
        """Return what each car's radio received; None with one tracker for the group."""
        return None if self._own is None else self._own.block

    def motion(self) -> tuple[F64, F64]:
        """Return odometer speeds [m/s] and steering angles [rad], (car)."""
        speed: F64 = self._swarm.odometer[0]
        steering: F64 = self._swarm.state.steering[0]
        return speed, steering

    def near(self) -> F64:
        """Return the readings of the distance sensors, (car, sensor) [m]."""
        near: F64 = self._swarm.proximity[0]
        return near

    def _judge(self) -> None:
        """Update task, operator and the count of collisions."""
        swarm = self._swarm
        self._task.update(swarm.state, swarm.t - STAND_STILL, self._touched, slice(0, 1))
        if self._reassignment is not None:
            # By the truth, as cars that decide alone do by their estimates.
            t = swarm.t - STAND_STILL
            self._reassignment.repeat(self._task, swarm.state, t, self._touched)
        self._operator.sample(swarm.state, self._task, slice(0, 1))
        if self._steps > AT_REST:
            self.collisions += int(self._touched.sum())
        self._touched[:] = 0.0


def at_decisions(episode: Episode) -> Episode:
    """Return the episode with its events delayed to the next decision, as in the simulation."""
    events = tuple(
        replace(event, t=math.ceil((event.t - SOON) / DECISION) * DECISION)
        for event in episode.events
    )
    return replace(episode, events=events)
