"""The safety gate: rules cap every command, and only armed cars move.

The gate is pure: a state and a snapshot give the permitted commands. Invariants: from any state,
silence longer than the limit leads to a stop; the output is within the limits for any input; a
disarmed car moves again only after `arm`, which requires `SafetyParams.health` seconds without a
disarming rule.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware_bridge.safety.moment import Moment
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import Picture
from hardware_bridge.safety.recent import Recent, at_rest
from hardware_bridge.safety.rules import RULES
from hardware_bridge.safety.telemetry import TelemetryState, no_telemetry
from tracking.arrays import F64, I64, Bool
from tracking.params.short_repr import short_repr

NO_REASON = -1
NOT_ARMED = -2
EMERGENCY = -3
HELD_UP = -4
LONGEST = 0.1
"""[s] Longest interval over which commands are ramped; longer pauses count as this one."""
REASONS = {
    NO_REASON: "",
    NOT_ARMED: "not armed",
    EMERGENCY: "emergency stop",
    HELD_UP: "the supervisor was held up, or the computer was suspended",
}


def reason_text(code: int) -> str:
    """Return the text of a code of `GateOutput.reason`."""
    return REASONS[code] if code < 0 else RULES[code].meaning


def is_reason(code: int) -> bool:
    """Return whether `reason_text` has a text for a code."""
    return code in REASONS or 0 <= code < len(RULES)


@dataclass(frozen=True, slots=True)
class GateOutput:
    """Commands to the cars, arrays over (env, car)."""

    __repr__ = short_repr

    speed: F64
    """[m/s] Commanded speed."""
    steering: F64
    """[rad] Commanded steering angle."""
    moving: Bool
    """False for neutral with brakes on."""
    armed: Bool
    cap: F64
    """[m/s] Speed that the rules permit in the requested direction."""
    reason: I64
    """Code of the reason for a speed below the requested one, see `reason_text`."""


class Gate:
    """Gates of a batch of groups."""

    def __init__(self, params: SafetyParams, n_envs: int, n_cars: int) -> None:
        self.params = params
        shape = (n_envs, n_cars)
        self.armed: Bool = np.zeros(shape, dtype=bool)
        self.emergency: Bool = np.zeros(n_envs, dtype=bool)
        """Latched until `clear`."""
        self._well_since: F64 = np.full(shape, np.inf)
        self._held: I64 = np.full(shape, NOT_ARMED)
        self._slow: Bool = np.zeros((len(RULES), *shape), dtype=bool)
        self._recent: Recent = at_rest(shape)
        self._last: F64 = np.full(n_envs, -np.inf)

    def stop(self, envs: slice = slice(None)) -> None:
        """Stop whole groups in an emergency, until `clear`."""
        self.emergency[envs] = True
        self.armed[envs] = False
        self._held[envs] = NOT_ARMED

    def clear(self, envs: slice = slice(None)) -> None:
        """End an emergency stop; every car must be armed again."""
        self.emergency[envs] = False

    def disarm(self) -> None:
        """Disarm all cars."""
        self.armed[:] = False
        self._held[:] = NOT_ARMED

    def interrupt(self) -> None:
        """Disarm all cars after a gap in the supervision and restart their `health` intervals."""
        self.armed[:] = False
        self._held[:] = HELD_UP
        self._well_since[:] = np.inf

    def arm(self, now: F64, cars: Bool) -> Bool:
        """Arm the requested cars after `SafetyParams.health` seconds without a disarming rule.

        Args:
            now: Current time, (env) [s].
            cars: Cars to arm, (env, car).

        Returns:
            All armed cars, (env, car).
        """
        well = now[:, None] - self._well_since >= self.params.health
        fit = cars & well & ~self.emergency[:, None]
        self.armed |= fit
        self._held[fit] = NO_REASON
        return self.armed.copy()

    def well_for(self, now: F64) -> F64:
        """Return the time for which no disarming rule has applied to each car, (env, car) [s]."""
        return np.maximum(now[:, None] - self._well_since, 0.0)

    @property
    def recent(self) -> Recent:
        """Bounds of the cars' motion given the commands sent so far."""
        return self._recent

    def step(
        self,
        picture: Picture,
        now: F64,
        word: F64,
        t_last_message: F64,
        linked: Bool,
        telemetry: TelemetryState | None = None,
    ) -> GateOutput:
        """Return the permitted commands.

        Args:
            picture: Latest snapshot.
            now: Current time, increasing from call to call, (env) [s].
            word: Time of the deciding process's last heartbeat, (env) [s].
            t_last_message: Time of the last message of each car's node, (env, car) [s].
            linked: True if the car's port is open, (env, car).
            telemetry: Telemetry of the cars' controllers; None without telemetry.
        """
        p = self.params
        telemetry = no_telemetry(t_last_message.shape, p) if telemetry is None else telemetry
        forward, backward = np.full((2, *t_last_message.shape), p.max_speed)
        left, right = np.full((2, *t_last_message.shape), p.max_steering)
        requested = np.nan_to_num(
            picture.requested_speed, nan=0.0, posinf=p.max_speed, neginf=-p.max_speed
        )
        ahead = requested >= 0.0
        limiting, holding = np.full((2, *t_last_message.shape), NO_REASON)
        # Comparisons with NaN are false; rules are written so that NaN counts as a fault.
        with np.errstate(invalid="ignore", over="ignore"):
            for k, rule in enumerate(RULES):
                verdict = rule.check(
                    Moment(
                        picture, now, word, t_last_message, linked,
                        self.armed, self._recent, telemetry, self._slow[k],
                    ), p
                )  # fmt: skip
                on, back = (np.where(cap >= 0.0, cap, 0.0) for cap in verdict[:2])
                self._slow[k] = (on < p.max_speed) | (back < p.max_speed)
                cap = np.where(ahead, on, back)
                limiting[(cap < np.where(ahead, forward, backward)) & (cap < np.abs(requested))] = k
                holding[verdict.hold & (holding == NO_REASON)] = k
                forward, backward = np.minimum(forward, on), np.minimum(backward, back)
                left, right = np.fmin(left, verdict.left), np.fmin(right, verdict.right)
        hold = holding != NO_REASON
        self._held = np.where(hold & self.armed, holding, self._held)
        self.armed &= ~hold & ~self.emergency[:, None]
        self._well_since = np.where(hold, np.inf, np.minimum(self._well_since, now[:, None]))
        speed = np.clip(requested, -backward, forward)
        steering = np.clip(np.nan_to_num(picture.requested_steering), -right, left)
        self._move(speed, steering, now)
        held = np.where(self.emergency[:, None], EMERGENCY, np.where(hold, holding, self._held))
        return GateOutput(
            speed=self._recent.speed.copy(),
            steering=self._recent.steering.copy(),
            moving=self.armed.copy(),
            armed=self.armed.copy(),
            cap=np.where(ahead, forward, backward),
            reason=np.where(self.armed, limiting, held),
        )

    def _move(self, speed: F64, steering: F64, now: F64) -> None:
        """Move the commands towards the permitted ones within the rate limits."""
        p = self.params
        elapsed = np.where(np.isfinite(self._last), now - self._last, 0.0)[:, None]
        self._last = now.copy()
        change = np.clip(elapsed, 0.0, LONGEST)
        speed = self._ramp(speed, p.max_accel * change)
        before, turn = self._recent.steering, p.max_steering_rate * change
        steering = np.clip(steering, before - turn, before + turn)
        speed = np.where(self.armed, speed, 0.0)
        steering = np.where(self.armed, steering, 0.0)
        self._recent = self._recent.after(speed, steering, elapsed, p.braking)

    def _ramp(self, speed: F64, most: F64) -> F64:
        """Limit the increase of absolute speed to `most` [m/s]; a reversal starts from zero."""
        before = self._recent.speed
        same = np.sign(speed) * np.sign(before) >= 0.0
        start = np.where(same, np.abs(before), 0.0)
        ramped: F64 = np.sign(speed) * np.minimum(np.abs(speed), start + most)
        return ramped
