"""Batch of simulated rooms: cars, their sensors and radios, stepped by commands.

It has no agents, rewards or ends of episodes. Its measurement blocks are the only input of a
tracker; recorded to a log and tracked from there, they give the same estimates.
"""

from __future__ import annotations

import copy
from typing import Any, Literal

import numpy as np

from relpos_env.geometry._clearance_kernels import read_clearances
from relpos_env.geometry.line_of_sight import pairs_in_sight
from relpos_env.interface.rangefinders import rangefinder_directions
from relpos_env.scenarios import Scenario
from relpos_env.scenarios.episode import Episode
from relpos_env.sensors._odometer_kernels import read_odometers
from relpos_env.sensors._proximity_kernels import read_proximity
from relpos_env.sensors.batch import Events, Sensors, make_events, make_sensors, start_sensors
from relpos_env.sensors.radio._radio_kernels import Scene
from relpos_env.sensors.radio.radio import Radio
from relpos_env.timing import DT, SOON
from relpos_env.world._car_kernels import STEERING
from relpos_env.world._step_kernels import begin_decision, run_steps
from relpos_env.world.arrays import Bodies, make_bodies, place_bodies
from relpos_env.world.car_nodes import car_constellation
from relpos_env.world.pymunk_space import PhysicsSpace
from relpos_env.world.room_state import RoomState
from relpos_env.world.solver import Solver, make_solver
from relpos_env.world.world_state import WorldState
from tracking.arrays import F64, Bool
from tracking.kernels.jit import bind
from tracking.measurements import MeasurementBlock
from tracking.records import as_records

Physics = Literal["pymunk", "fast"]
SENSORS = "imu", "mag", "odometer", "proximity"
SPARE_BOXES = 8
"""[-] Largest number of shapes added to a space that sensors detect."""


class World:
    """Simulated groups of cars.

    Properties: equal episodes, seeds and commands give equal results, bit for bit; environment k
    of a batch equals that environment alone.
    """

    def __init__(
        self,
        scenario: Scenario,
        n_cars: int,
        n_envs: int = 1,
        n_steps: int = 10,
        proximity: int = 0,
        physics: Physics = "pymunk",
        sends_motion: bool = False,
    ) -> None:
        """Allocate the batch; `begin` starts its episodes.

        Args:
            scenario: Scenario; its room, protocol and number of boxes hold for all episodes.
            n_cars: Largest number of cars in a group.
            n_envs: Number of groups.
            n_steps: Steps of `DT` in one `step`.
            proximity: Number of distance sensors of each car.
            physics: `pymunk`: the cars move in a space that is kept, see `world`. `fast`: the space
                is used only for contacts; the motion without contacts is equal, bit for bit.
            sends_motion: Ranging messages carry preintegrated motion.
        """
        self.scenario, self.n_steps = scenario, n_steps
        self.constellation = car_constellation(scenario, n_cars)
        e, n = n_envs, n_cars
        spare = SPARE_BOXES if physics == "pymunk" else 0
        self._bodies = make_bodies(e, n, max(scenario.max_boxes, 1) + spare)
        self._bodies.fast[:] = physics == "fast"
        self._sensors = make_sensors(e, n, scenario.mag.n_waves)
        self.odometer: F64 = np.zeros((e, n))
        """Last readings of the odometers, (env, car) [m/s]."""
        self.proximity: F64 = np.zeros((e, n, proximity))
        """Last readings of the distance sensors, (env, car, sensor) [m]; 0 for absent cars."""
        self._clearance: F64 = np.zeros((e, n))
        radio = scenario.radio.with_motion() if sends_motion else scenario.radio
        windows = n_steps if sends_motion else 0
        self._radio = Radio(radio.for_nodes(n), n, [0] * e, DT, overheard_windows=windows)
        self._scene = Scene(
            np.zeros((e, n, 3)), np.zeros((e, n, 3)), self._bodies.boxes, np.zeros((e, 0, 7))
        )
        self._members: F64 = np.zeros((e, n, 2))
        self.events = make_events(e, n, n_steps, self._radio.room)
        self._groups = [RoomState() for _ in range(e)]
        self._solver = make_solver(e, n, self._bodies.boxes.shape[1])
        self._next_life = np.full(e, np.inf)
        self.to_come: Bool = np.zeros((e, n), dtype=bool)
        """Cars that will join, for the first time or again, (env, car)."""
        self.t: F64 = np.zeros(e)
        """Time since each group began, (env) [s]."""
        self._bind()

    @property
    def n_envs(self) -> int:
        """Number of groups."""
        return len(self._bodies.tick)

    @property
    def body(self) -> F64:
        """x, y [m], heading [rad], velocity x, y [m/s] and yaw rate [rad/s], (env, car, 6)."""
        return self._bodies.body

    @property
    def powered(self) -> Bool:
        """Mask of the trackers with power, (env, car)."""
        return self._bodies.powered

    @property
    def contacts(self) -> F64:
        """Contacts that each car began in the last step, (env, car)."""
        return self._bodies.contacts

    @property
    def solver_moves(self) -> int:
        """Number of steps made by the rigid-body solver, in all groups together."""
        return int(self._solver.calls["moves"].sum())

    @property
    def boxes(self) -> F64:
        """Obstacles in the rooms, (env, box, 6); half sizes are zero in unused rows.

        Columns: centre x, y, half width and depth [m], cosine and sine of the angle.
        """
        return self._bodies.boxes

    @property
    def nlos_share(self) -> F64:
        """Share of NLOS ranges in the last step, (env)."""
        ranges = self.events.valid & self.events.has_power
        share: F64 = (self.events.nlos & ranges).sum(axis=1) / np.maximum(ranges.sum(axis=1), 1)
        return share

    def part(self, envs: slice) -> World:
        """Return a view of some of the groups that shares their memory."""
        part = copy.copy(self)
        part._bodies = Bodies._make(a[envs] for a in self._bodies)
        part._sensors = Sensors._make(a[envs] for a in self._sensors)
        part.odometer, part.proximity = self.odometer[envs], self.proximity[envs]
        part._radio, part._members = self._radio.part(envs), self._members[envs]
        part._scene = Scene._make(a[envs] for a in self._scene)
        part._groups, part._clearance = self._groups[envs], self._clearance[envs]
        part._solver = Solver._make(a[envs] for a in self._solver)
        part._next_life, part.to_come = self._next_life[envs], self.to_come[envs]
        part.events, part.t = Events._make(a[envs] for a in self.events), self.t[envs]
        part._bind()
        return part

    def begin(self, env: int, episode: Episode, rng: np.random.Generator) -> None:
        """Start an episode of a group.

        Args:
            env: Index of the group.
            episode: Episode to start.
            rng: Generator of the group; draws of its parts do not depend on each other.
        """
        b, group = self._bodies, self._groups[env]
        place_bodies(b, env, episode, self.scenario.room)
        start_sensors(self._sensors, env, episode, rng)
        self.t[env] = 0.0
        self._scene.pos1[env, :, :2] = b.body[env, :, :2]
        self._scene.pos1[env, :, 2] = self._sensors.mast[env] + self._sensors.mount[env, :, 2]
        group.life = episode.events
        group.obstacles, group.car, group.size = episode.obstacles, episode.car, self.scenario.room
        group.begin(b, self._solver, env)
        self._radio.reset(env, int(rng.integers(1 << 62)), episode.radio)
        self.overheard.used[env] = 0
        self._members[env] = 0.0
        group.boots = rng.spawn(1)[0]
        for n in np.nonzero(episode.present)[0].tolist():
            self._radio.switch_on(env, n, boot=int(group.boots.integers(256)))
        # Drawn last, so that the other draws are the same without distance sensors.
        self._sensors.proximity_seed[env] = rng.integers(1 << 62)
        if self.scenario.furnish is not None:
            self.scenario.furnish(self.world(env), rng.spawn(1)[0])
            self._groups[env].read(b, env)
        self._read_clearances()
        self._look_ahead(env)

    def step(self, speed: F64, steering: F64) -> MeasurementBlock:
        """Drive for `n_steps` steps and return all measurements.

        Args:
            speed: Commanded speed, (env, car) [m/s]; cars that join in this step use 0.
            steering: Commanded steering angle, (env, car) [rad]; cars that join in this step use 0.

        Returns:
            Measurements, roughly in order; valid until the next step.
        """
        self._speed[...], self._steering[...] = speed, steering
        for env, group in enumerate(self._groups):
            group.read(self._bodies, env)
        if self._begin_decision():
            for env in np.nonzero(self._next_life <= self.t + SOON)[0].tolist():
                t = float(self.t[env])
                group = self._groups[env]
                group.live(self._bodies, self._solver, self._radio, self._scene.pos1, env, t)
                self._look_ahead(env)
        while n_waiting := self._run_steps():
            for env in self._waiting[:n_waiting].tolist():
                self._groups[env].move(self._bodies, self._solver, env, DT)
        self._read_odometers()
        self._read_clearances()
        if self.proximity.shape[-1]:
            self._read_proximity()
        return self.block

    def world(self, env: int) -> PhysicsSpace:
        """Return the space of a group to inspect and change; from then on, only pymunk steps it.

        Raises:
            EnvError: `physics` is "fast".
        """
        return self._groups[env].open(self._bodies, self._solver, env)

    def movable(self, env: int) -> Bool:
        """Return which boxes of a room are movable, (box)."""
        return self._groups[env].movable(self.boxes.shape[1])

    def line_of_sight(self, env: int) -> Bool:
        """Return which cars have line of sight to each other, (car, car)."""
        return pairs_in_sight(self._bodies.body[env, :, :2], self._bodies.boxes[env])

    def _look_ahead(self, env: int) -> None:
        """Update the time of the next event and the cars that will join."""
        group = self._groups[env]
        self._next_life[env] = group.next_event
        self.to_come[env] = False
        self.to_come[env, group.to_come()] = True

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the results of `_bind` and the solver with its addresses."""
        bound = {"_begin_decision", "_run_steps", "_read_odometers", "_read_proximity"}
        bound |= {"_read_clearances", "block", "overheard", "state", "_solver"}
        return {k: v for k, v in self.__dict__.items() if k not in bound}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        n_envs, n_cars, _ = self._bodies.body.shape
        self._solver = make_solver(n_envs, n_cars, self._bodies.boxes.shape[1])
        self._bind()

    def _bind(self) -> None:
        """Bind the kernels to their arrays, which stay at the same addresses."""
        bodies = self._bodies._replace(cars=as_records(self._bodies.cars))
        records = {k: as_records(getattr(self._sensors, k)) for k in SENSORS}
        sensors = self._sensors._replace(**records)
        self._speed, self._steering = np.zeros_like(self.odometer), np.zeros_like(self.odometer)
        self._waiting = np.zeros(self.n_envs, dtype=np.int64)
        self._begin_decision = bind(
            begin_decision, bodies, self.events, self.t, self._next_life, self._speed,
            self._steering,
        )  # fmt: skip
        solver = self._solver._replace(calls=as_records(self._solver.calls))
        self._run_steps = bind(
            run_steps, bodies, solver, sensors, self._radio.kernel_arguments, self._members,
            self._scene, self.n_steps, DT, self.events, self._speed, self._steering, self.t,
            self._waiting,
        )  # fmt: skip
        self._read_odometers = bind(
            read_odometers, sensors.odometer, sensors.odometer_seed, bodies.tick, bodies.body,
            bodies.present, self.odometer,
        )  # fmt: skip
        self._read_proximity = bind(
            read_proximity, sensors.proximity, sensors.proximity_seed, bodies.tick,
            rangefinder_directions(self.proximity.shape[-1]), bodies.body, bodies.present,
            bodies.size, bodies.room, bodies.boxes, self.proximity,
        )  # fmt: skip
        self._read_clearances = bind(
            read_clearances, bodies.body, bodies.present, bodies.size, bodies.room, bodies.boxes,
            self._clearance,
        )  # fmt: skip
        self.overheard = self._radio.overheard
        """What every car knows from its radio since the reader emptied it; shares memory."""
        self.block = MeasurementBlock(*self.events[:9])
        """Measurements of the last step; shares memory."""
        b = self._bodies
        self.state = WorldState(
            t=self.t,
            pos_w=b.body[..., 0:2],
            vel_w=b.body[..., 3:5],
            accel_w=b.accel,
            heading=b.body[..., 2],
            yaw_rate=b.body[..., 5],
            steering=b.drive[..., STEERING],
            clearance=self._clearance,
            present=b.present,
        )
        """Current true state; shares memory."""
