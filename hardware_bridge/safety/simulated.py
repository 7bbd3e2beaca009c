"""The safety gate in the simulated loop: the cars get its output as commands.

It runs once per decision, a tenth of its rate on real cars, and arms the cars whenever possible,
as an operator would.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware_bridge.safety.gate import NOT_ARMED, Gate, reason_text
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import blank_picture, largest_std
from relpos_env.interface.views import AgentView
from tracking.arrays import F64, Bool


class SimulatedGate:
    """Gates of a batch of rooms. Invariant: results of a room do not depend on the batch."""

    def __init__(self, n_envs: int, n_cars: int, params: SafetyParams | None = None) -> None:
        """Create gates with all cars disarmed.

        Args:
            n_envs: Rooms.
            n_cars: Slots for cars.
            params: Limits.
        """
        self._params = params or SafetyParams()
        shape = (n_envs, n_cars)
        self._gates = [Gate(self._params, 1, n_cars) for _ in range(n_envs)]
        self._asked, self._speed, self._steering = (np.zeros(shape) for _ in range(3))
        self._stopped: Bool = np.ones(shape, dtype=bool)
        self._reason = np.full(shape, NOT_ARMED)

    def reset(self, env: int) -> None:
        """Reset one room."""
        self._gates[env] = Gate(self._params, 1, self._asked.shape[1])
        self._asked[env] = self._speed[env] = self._steering[env] = 0.0
        self._stopped[env], self._reason[env] = True, NOT_ARMED

    def allow(self, view: AgentView, speed: F64, steering: F64) -> tuple[F64, F64]:
        """Return the permitted commands.

        Args:
            view: State that the decision was based on.
            speed: Requested speed, (env, car) [m/s].
            steering: Requested steering angle, (env, car) [rad].

        Returns:
            Speed [m/s] and steering [rad], each (env, car).
        """
        self._asked[:] = speed
        for env, gate in enumerate(self._gates):
            here = view.part(slice(env, env + 1))
            now = here.now.copy()
            q = blank_picture(1, speed.shape[1])
            q.t[:] = now
            q.requested_speed[0], q.requested_steering[0] = speed[env], steering[env]
            q.present[:], q.oriented[:] = here.present, here.oriented
            q.heading[:], q.speed[:] = here.heading, here.speed
            q.status[:], q.pos[:], q.vel[:] = here.status, here.pos, here.vel
            q.distance[:], q.ranged[:] = here.distance, here.t_last_range
            q.sigma[:] = largest_std(here.cov)
            q.sound[:] = np.isfinite(q.sigma)
            everyone = np.ones((1, speed.shape[1]), dtype=bool)
            t_last_message = np.repeat(now[:, None], speed.shape[1], axis=1)
            out = gate.step(q, now, now, t_last_message, everyone)
            gate.arm(now, here.present)
            self._speed[env], self._steering[env] = out.speed[0], out.steering[0]
            self._stopped[env], self._reason[env] = ~out.armed[0], out.reason[0]
        return self._speed, self._steering

    def infos(self) -> dict[str, NDArray[Any]]:
        """Return the gate's entries of the infos, (env, car), as on real cars."""
        why = [[reason_text(code) for code in row] for row in self._reason.tolist()]
        return {
            "asked_speed": self._asked.copy(),
            "allowed_speed": self._speed.copy(),
            "allowed_steering": self._steering.copy(),
            "stopped": self._stopped.copy(),
            "gate": np.array(why, dtype=object),
        }
