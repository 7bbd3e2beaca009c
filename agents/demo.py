"""Three cars keep a formation on estimates: what `relpos demo` does, as a function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.controllers import CONTROLLERS
from agents.controllers.base import split_fields
from agents.track import TrackResult, track_log
from relpos_env import formation_v0
from relpos_env.parallel_env import FormationEnv
from relpos_env.registry import look_up
from tracking.filters import FILTERS
from tracking.log import Log

SETTLE = 10.0
"""[s] Errors are averaged from here on."""


@dataclass(frozen=True, slots=True)
class DemoResult:
    """One demonstration."""

    scenario: str
    seed: int
    seconds: float
    formation_error: float
    """[m] Mean distance of the others from where they should be, tracker in the loop."""
    formation_error_truth: float
    """[m] The same when the cars are told the truth."""
    formation_error_blind: float
    """[m] The same when they are told nothing and follow the operator's command alone."""
    nlos_share: float
    """[-] Share of the ranges that an obstacle was in the way of."""
    collisions: int
    """[-] Contacts of any car."""
    tracks: tuple[TrackResult, ...]
    """The same drive tracked by every filter."""
    frames: dict[str, Any]
    """What the animation shows."""

    @property
    def summary(self) -> list[dict[str, Any]]:
        """The figures, one record a filter and one for the formation."""
        rows: list[dict[str, Any]] = [{"result": "tracking", **r.summary} for r in self.tracks]
        return [
            *rows,
            {
                "result": "formation",
                "scenario": self.scenario,
                "seed": self.seed,
                "seconds": self.seconds,
                "formation_error": self.formation_error,
                "formation_error_truth": self.formation_error_truth,
                "formation_error_blind": self.formation_error_blind,
                "nlos_share": self.nlos_share,
                "collisions": self.collisions,
            },
        ]


def demo(
    *,
    scenario: str = "ring-nlos",
    seconds: float = 60.0,
    seed: int = 0,
    cars: int = 3,
    controller: str = "consensus",
    progress: Callable[[float], None] | None = None,
) -> DemoResult:
    """Drive a formation on estimates and, for comparison, on the truth.

    Raises:
        EnvError: An unknown name or a number out of range.
    """
    cycles = round(seconds * 10)
    drive = {}
    log: Log | None = None
    frames: dict[str, Any] = {}
    told = ("estimate", "truth", "nothing")
    for n, observation in enumerate(told):
        env = formation_v0.parallel_env(
            scenario=scenario,
            n_cars=cars,
            observation="truth" if observation == "truth" else "estimate",
            max_cycles=cycles,
            record=observation == "estimate",
        )
        recorder = FrameRecorder(env) if observation == "estimate" else None
        observations, _ = env.reset(seed=seed)
        policy = look_up(CONTROLLERS, controller, "controller")(env.fields)
        errors, nlos = [], []
        for k in range(cycles):
            if observation == "nothing":
                observations = {a: _blinded(env, o) for a, o in observations.items()}
            actions = {a: policy.act(o) for a, o in observations.items()}
            observations, _, _, _, infos = env.step(actions)
            errors.append(np.mean([info["formation_error"] for info in infos.values()]))
            nlos.append(env.loop.sim.nlos_share)
            if recorder is not None:
                recorder.add(infos)
            if progress is not None:
                progress((n + (k + 1) / cycles) / len(told))
        from_here = min(int(SETTLE * 10), cycles - 1)
        drive[observation] = float(np.mean(errors[from_here:]))
        if recorder is not None:
            log = env.recorded_log(f"{scenario}-{seed}")
            frames = recorder.frames
            share = float(np.mean(nlos))
            collisions = int(env.loop.sim.world.n_collisions.sum())
        env.close()
    assert log is not None
    return DemoResult(
        scenario=scenario,
        seed=seed,
        seconds=seconds,
        formation_error=drive["estimate"],
        formation_error_truth=drive["truth"],
        formation_error_blind=drive["nothing"],
        nlos_share=share,
        collisions=collisions,
        tracks=tuple(track_log(log, filter=name) for name in FILTERS),
        frames=frames,
    )


def _blinded(env: FormationEnv, observation: np.ndarray) -> np.ndarray:
    """An observation in which no other car is known."""
    blinded = observation.copy()
    blinded[split_fields(env.fields)["mask"]] = 0.0
    return blinded


class FrameRecorder:
    """Collects what the animation shows, rounded to a millimetre."""

    def __init__(self, env: FormationEnv) -> None:
        self._env = env
        scenario = env.scenario
        self.frames: dict[str, Any] = {
            "room": list(scenario.room),
            "car": [scenario.car.length, scenario.car.width],
            "obstacles": [np.round(o.corners(), 3).tolist() for o in scenario.obstacles],
            "dt": 0.1,
        }
        names = ("t", "pos", "heading", "sight", "target", "estimate", "tracking", "formation")
        self.frames |= {name: [] for name in names}

    def add(self, infos: dict[str, Any]) -> None:
        """One frame from the environment as it stands."""
        env, f = self._env, self.frames
        loop = env.loop
        state, belief = loop.state, loop.belief()
        i, j = loop.sim.constellation.pairs.T
        sight = loop.sim.world.pairs_in_sight(state.pos_w)[i, j]
        estimate = loop.estimate.at(loop.sim.t).take(0)
        n = len(state.heading)
        others = []
        for b in range(1, n):
            pair = loop.sim.constellation.pair_index[0, b]
            others.append(
                [*belief.pos_w[0, b], *_ellipse(estimate.cov[pair, :2, :2])]
                if belief.ok[0, b]
                else None
            )
        tracking = [v["tracking_error"] for v in infos.values() if v["tracked"]]
        f["t"].append(round(state.t, 2))
        f["pos"].append(np.round(state.pos_w, 3).tolist())
        f["heading"].append(np.round(state.heading, 3).tolist())
        f["sight"].append(sight.astype(int).tolist())
        f["target"].append(np.round(env.target()[0, 1:], 3).tolist())
        f["estimate"].append([None if o is None else np.round(o, 3).tolist() for o in others])
        f["tracking"].append(round(float(np.mean(tracking)), 3) if tracking else None)
        mean = float(np.mean([v["formation_error"] for v in infos.values()]))
        f["formation"].append(round(mean, 3))


def _ellipse(cov: np.ndarray) -> tuple[float, float, float]:
    """Standard deviations along the axes of a covariance, and the angle of the first [rad]."""
    values, vectors = np.linalg.eigh(cov)
    a, b = np.sqrt(np.maximum(values[::-1], 0.0))
    return float(a), float(b), float(np.arctan2(vectors[1, 1], vectors[0, 1]))
