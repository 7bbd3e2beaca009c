"""The gate that every command passes: rules cap it, and cars are armed or they stand.

Pure: a state, a moment, and what the cars may do then. Laws: from any state, silence longer than
the limit leads to a stop; the output is within the limits whatever comes in; a car that was
stopped for good moves again only after `arm`, and that only after `SafetyParams.health` seconds
in which all was well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware_bridge.safety.moment import Moment
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import Picture
from hardware_bridge.safety.recent import Recent, at_rest
from hardware_bridge.safety.rules import RULES
from hardware_bridge.safety.telemetry import Told, nothing_told
from tracking.arrays import F64, I64, Bool
from tracking.params.short_repr import short_repr

NO_REASON = -1
NOT_ARMED = -2
EMERGENCY = -3
HELD_UP = -4
LONGEST = 0.1
"""[s] After a longer pause commands change by no more than after this one."""
REASONS = {
    NO_REASON: "",
    NOT_ARMED: "not armed",
    EMERGENCY: "emergency stop",
    HELD_UP: "the supervisor was held up, or the computer was suspended",
}


def reason_text(code: int) -> str:
    """What a code of `GateOutput.reason` says."""
    return REASONS[code] if code < 0 else RULES[code].meaning


def is_reason(code: int) -> bool:
    """True for the codes that `reason_text` knows."""
    return code in REASONS or 0 <= code < len(RULES)


@dataclass(frozen=True, slots=True)
class GateOutput:
    """What the cars are told now, arrays over (env, car)."""

    __repr__ = short_repr

    speed: F64
    """[m/s]"""
    steering: F64
    """[rad]"""
    moving: Bool
    """False: neutral, brakes on."""
    armed: Bool
    cap: F64
    """[m/s] What the rules allow in the direction that was wanted."""
    reason: I64
    """Why it is slower than wanted, see `reason_text`."""


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
        """Emergency stop of whole groups."""
        self.emergency[envs] = True
        self.armed[envs] = False
        self._held[envs] = NOT_ARMED

    def clear(self, envs: slice = slice(None)) -> None:
        """End an emergency stop; every car must be armed again."""
        self.emergency[envs] = False

    def disarm(self) -> None:
        """Let all cars stand."""
        self.armed[:] = False
        self._held[:] = NOT_ARMED

    def interrupt(self) -> None:
        """There was no supervision for a while: let all cars stand, and be well again."""
        self.armed[:] = False
        self._held[:] = HELD_UP
        self._well_since[:] = np.inf

    def arm(self, now: F64, cars: Bool) -> Bool:
        """Arm those cars of which all was well for long enough.

        Args:
            now: (env) [s]
            cars: Which are asked for, (env, car).

        Returns:
            Which are armed now, (env, car).
        """
        well = now[:, None] - self._well_since >= self.params.health
        fit = cars & well & ~self.emergency[:, None]
        self.armed |= fit
        self._held[fit] = NO_REASON
        return self.armed.copy()

    def well_for(self, now: F64) -> F64:
        """How long all has been well with each car, (env, car) [s]."""
        return np.maximum(now[:, None] - self._well_since, 0.0)

    @property
    def recent(self) -> Recent:
        """What the cars may still be doing for what they were sent."""
        return self._recent

    def step(
        self,
        picture: Picture,
        now: F64,
        word: F64,
        heard: F64,
        linked: Bool,
        told: Told | None = None,
    ) -> GateOutput:
        """What the cars may do now.

        Args:
            picture: The latest.
            now: Rises from call to call, (env) [s].
            word: When the deciding process last gave a sign of life, (env) [s].
            heard: When each car's node was last heard, (env, car) [s].
            linked: Whether the car's port is open, (env, car).
            told: What the cars' controllers say; None where they say nothing.
        """
        p = self.params
        told = nothing_told(heard.shape, p) if told is None else told
        forward, backward = np.full((2, *heard.shape), p.max_speed)
        left, right = np.full((2, *heard.shape), p.max_steering)
        wanted = np.nan_to_num(
            picture.speed_wanted, nan=0.0, posinf=p.max_speed, neginf=-p.max_speed
        )
        ahead = wanted >= 0.0
        limiting, holding = np.full((2, *heard.shape), NO_REASON)
        # What is not a number passes no comparison; rules see to it that it passes for unwell.
        with np.errstate(invalid="ignore", over="ignore"):
            for k, rule in enumerate(RULES):
                verdict = rule.check(
                    Moment(
                        picture, now, word, heard, linked,
                        self.armed, self._recent, told, self._slow[k],
                    ), p
                )  # fmt: skip
                on, back = (np.where(cap >= 0.0, cap, 0.0) for cap in verdict[:2])
                self._slow[k] = (on < p.max_speed) | (back < p.max_speed)
                cap = np.where(ahead, on, back)
                limiting[(cap < np.where(ahead, forward, backward)) & (cap < np.abs(wanted))] = k
                holding[verdict.hold & (holding == NO_REASON)] = k
                forward, backward = np.minimum(forward, on), np.minimum(backward, back)
                left, right = np.fmin(left, verdict.left), np.fmin(right, verdict.right)
        hold = holding != NO_REASON
        self._held = np.where(hold & self.armed, holding, self._held)
        self.armed &= ~hold & ~self.emergency[:, None]
        self._well_since = np.where(hold, np.inf, np.minimum(self._well_since, now[:, None]))
        speed = np.clip(wanted, -backward, forward)
        steering = np.clip(np.nan_to_num(picture.steering_wanted), -right, left)
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
        """Go towards what is allowed, no faster than commands may change."""
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
        """Speeds that rise by so much at most; they may fall, and reverse through zero."""
        before = self._recent.speed
        same = np.sign(speed) * np.sign(before) >= 0.0
        start = np.where(same, np.abs(before), 0.0)
        ramped: F64 = np.sign(speed) * np.minimum(np.abs(speed), start + most)
        return ramped
