"""Simulation of one room with its recording."""

from __future__ import annotations

import numpy as np

from relpos_env.interface.actions import DriveCommand
from relpos_env.scenarios import Scenario
from relpos_env.scenarios.episode import draw_episode
from relpos_env.simulation.recorder import Recording
from relpos_env.timing import DECISION, DT
from relpos_env.world.world import World
from relpos_env.world.world_state import WorldState
from tracking.arrays import F64
from tracking.constellation import Constellation
from tracking.log import Log
from tracking.measurements import MeasurementBlock


class Simulation:
    """One group of cars. Equal scenarios, generators and commands give equal results."""

    def __init__(
        self, scenario: Scenario, rng: np.random.Generator, *, seconds: float = 3600.0
    ) -> None:
        """Draw an episode of a scenario.

        Args:
            scenario: Scenario; the group has its largest number of cars.
            rng: Generator of the episode; the driver gets a child of it, `driver_rng`.
            seconds: Length of the episode.
        """
        n = scenario.most_cars
        self.scenario = scenario
        self.swarm = World(scenario, n, n_steps=round(DECISION / DT))
        episode, group, self.driver_rng = rng.spawn(3)
        self.swarm.begin(0, draw_episode(scenario, n, seconds, episode), group)
        self._recording = Recording()

    @property
    def constellation(self) -> Constellation:
        """Nodes on the cars."""
        return self.swarm.constellation

    @property
    def state(self) -> WorldState:
        """Current true state, arrays over (car, ...)."""
        return self.swarm.state.take(0)

    @property
    def t(self) -> float:
        """Time [s]."""
        return float(self.swarm.t[0])

    @property
    def n_collisions(self) -> F64:
        """Contacts that each car began in the last step, (car)."""
        contacts: F64 = self.swarm.contacts[0]
        return contacts

    def step(self, command: DriveCommand) -> MeasurementBlock:
        """Drive for one control period (0.1 s) and return all measurements in order of time."""
        block = self.swarm.step(command.speed[None], command.steering[None])
        self._recording.add_swarm(self.swarm)
        return block.env(0).sorted()

    def to_log(self, name: str) -> Log:
        """Return the recording as a log with truth at 50 Hz."""
        return self._recording.to_log(name, self.scenario.name, self.constellation, truth_every=2)
