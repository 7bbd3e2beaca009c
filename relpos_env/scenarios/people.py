"""Scenarios of a person with six trackers who exercises in the room of the paper, 3 m x 5 m.

From Armani and Holz, ICRA 2024, section III: trackers on right upper arm, right wrist, right
hip, left wrist, right knee and left knee; walking, jumping jacks, squats. A person has no
actions, so these scenarios can be recorded and tracked but not be an environment.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from relpos_env.errors import EnvError
from relpos_env.sensors.imu import HUMAN_IMU, ImuSimParams
from relpos_env.sensors.magnetometer import MagSimParams
from relpos_env.sensors.radio.channel import BODY
from relpos_env.sensors.radio.params import RadioSimParams


@dataclass(frozen=True, slots=True, kw_only=True)
class HumanScenario:
    """A person in a room, with wearable sensors."""

    name: str
    room: tuple[float, float] = (3.0, 5.0)
    """[m] Size along x and y; the origin is the centre."""
    motion: Literal["procedural", "recorded"] = "procedural"
    """Motion from an animated skeleton, or from motion capture."""
    exercises: tuple[str, ...] = ("walking", "jumping-jacks", "squats")
    """Names in `relpos_env.people.exercises.EXERCISES`, repeated in turn; not used for recorded
    motion."""
    imu: ImuSimParams = field(default=HUMAN_IMU)
    mag: MagSimParams = field(default_factory=MagSimParams)
    radio: RadioSimParams = field(default_factory=lambda: RadioSimParams(channel=BODY))

    def __post_init__(self) -> None:
        if self.motion not in ("procedural", "recorded"):
            raise EnvError(f"motion: expected procedural or recorded, got {self.motion!r}")
        if not self.exercises:
            raise EnvError("exercises: expected at least one")


HUMAN = HumanScenario(name="human")
HUMAN_MOCAP = HumanScenario(name="human-mocap", motion="recorded")
