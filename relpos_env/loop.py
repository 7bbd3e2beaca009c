"""The tracker in the loop: the simulation, its measurements, and what the cars believe.

    command -> Simulation -> measurements -> Horizon -> Tracker -> belief of every car

The tracker gets nothing but measurements. Its estimate is as old as the horizon's delay and
is carried to the present at constant velocity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relpos_env.interface.actions import DriveCommand
from relpos_env.interface.views import TeamBelief
from relpos_env.scenarios import Scenario
from relpos_env.sim import Simulation
from relpos_env.timing import DT, STAND_STILL
from relpos_env.world import WorldState
from tracking.estimate import TeamEstimate
from tracking.horizon import Horizon, HorizonParams
from tracking.ranging.airtime import round_rate
from tracking.tracker import Tracker, TrackerParams


def default_params(scenario: Scenario) -> TrackerParams:
    """What the trackers believe by default: they wait for ranges as long as a round takes."""
    radio = scenario.radio.for_nodes(scenario.n_cars)
    rounds = 1.5 / round_rate(radio.session.phy, scenario.n_cars)
    return TrackerParams(horizon=HorizonParams(delay=max(HorizonParams().delay, rounds)))


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopConfig:
    """What runs in the loop."""

    scenario: Scenario
    filter: str
    params: TrackerParams
    step: float = 0.1
    """[s] One decision."""


class TrackedSimulation:
    """A simulation whose cars know each other through their trackers."""

    def __init__(
        self, config: LoopConfig, rng: np.random.Generator, *, record: bool = False
    ) -> None:
        self.config = config
        self.sim = Simulation(config.scenario, rng, record=record)
        self._tracker = Tracker(self.sim.constellation, config.params, filter=config.filter)
        self._horizon = Horizon(config.params.horizon)
        self._n_steps = round(config.step / DT)
        self.estimate: TeamEstimate
        """The tracker's last estimate, as old as the horizon."""
        n = config.scenario.n_cars
        still = DriveCommand(0.0, np.zeros(n), np.zeros(n))
        for _ in range(round(STAND_STILL / config.step)):
            self.step(still)

    @property
    def state(self) -> WorldState:
        """The truth now."""
        return self.sim.state

    def step(self, command: DriveCommand) -> None:
        """Drive for one decision and let the tracker catch up."""
        measured = self.sim.step(command, self._n_steps)
        now = self.sim.t
        due = self._horizon.step(measured, now)
        self.estimate = self._tracker.step(due, self._horizon.t)

    def belief(self, *, truth: bool = False) -> TeamBelief:
        """What the cars believe now; the truth only for a mode that needs it."""
        if truth:
            state = self.state
            return TeamBelief.from_truth(state.pos_w, state.vel_w, state.heading)
        return TeamBelief.from_estimate(self.estimate.at(self.sim.t).take(0))
