"""RLlib environment with cars that join, leave and return in mid-episode.

RLlib's wrapper of PettingZoo environments assumes that the initial agents stay for the whole
episode, and fails when one joins or leaves. In this environment an agent acts only after a step
with its observation, which is RLlib's meaning of the keys of the dicts.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import ray
from ray.rllib.env.multi_agent_env import MultiAgentEnv

from agents.simulation.demo import SETTLE
from relpos_env.api.parallel_env import FormationEnv
from relpos_env.timing import DECISION

ALL = "__all__"
"""RLlib's key of the whole episode."""
OWN_SEEDS = 1 << 63
"""Smallest training seed, which keeps them distinct from the seeds of comparisons."""


class FormationMultiAgentEnv(MultiAgentEnv):  # type: ignore[misc]
    """`relpos_env.api.parallel_env.FormationEnv` for RLlib; spaces and numbers are the same.

    | car | dicts of a step |
    |---|---|
    | present | as in the PettingZoo environment |
    | joins | included from this step on |
    | temporarily absent | left out, so that absences are not learnt from; the reward is 0 |
    | leaves for good | truncated in this step, then left out |
    | end of the episode | all agents, absent ones with zeros |

    Invariant: the value of every key equals that of the PettingZoo environment, bit for bit.
    """

    def __init__(self, arguments: Mapping[str, Any] | None = None) -> None:
        """Build the environment.

        Args:
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: Unknown name or a number out of range; names the argument.
        """
        self.env = FormationEnv(**(arguments or {}))
        self.possible_agents = list(self.env.possible_agents)
        self.agents: list[str] = []
        self.observation_spaces = self.env.observation_spaces
        self.action_spaces = self.env.action_spaces
        self._shown: set[str] = set()
        super().__init__()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode; see `FormationEnv.reset`."""
        observations, infos = self.env.reset(seed=seed, options=options)
        self.agents = list(self.env.agents)
        shown = [a for a in self.agents if infos[a]["present"]]
        self._shown = set(shown)
        return _only(observations, shown), _only(infos, shown)

    def step(self, action_dict: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
        """Drive for 0.1 s.

        Args:
            action_dict: Action of every agent with an observation in the previous step.

        Raises:
            EnvError: As `FormationEnv.step`.
        """
        env = self.env
        # Actions of absent cars have no effect, but the environment requires them.
        nothing = {a: self._idle(a) for a in env.agents if a not in self._shown}
        found, rewards, terminated, truncated, infos = env.step({**action_dict, **nothing})
        over = not env.agents
        shown = [a for a in found if over or truncated[a] or infos[a]["present"]]
        self.agents = list(found) if over else list(env.agents)
        self._shown = {a for a in shown if a in env.agents}
        ended = {**_only(terminated, shown), ALL: over and any(terminated.values())}
        cut = {**_only(truncated, shown), ALL: over and not any(terminated.values())}
        return _only(found, shown), _only(rewards, shown), ended, cut, _only(infos, shown)

    def render(self) -> Any:
        """See `FormationEnv.render`."""
        return self.env.render()

    def close(self) -> None:
        """See `FormationEnv.close`."""
        self.env.close()

    def _idle(self, agent: str) -> Any:
        """Return a zero action."""
        space = self.action_spaces[agent]
        return np.zeros(space.shape, dtype=space.dtype)


class SeededEnv(FormationMultiAgentEnv):
    """Environment of env runners, with distinct seeds.

    RLlib gives environment i of runner w the seed s + w + i, so runners would share episodes, and
    the seeds of many runners would overlap with those of comparisons.
    """

    def __init__(self, context: Any) -> None:
        """Build an environment of one runner.

        Args:
            context: RLlib's `EnvContext` with ``arguments`` (see the base class) and ``seed``.
        """
        super().__init__(context["arguments"])
        # A recreated runner continues with other episodes.
        again = os.getpid() if context.recreated_worker or _made_again() else 0
        self._place = context["seed"], context.worker_index or 0, again
        self._begun = False
        self._errors: list[float] = []

    @property
    def formation_error(self) -> float:
        """[m] Mean formation error over cars and the time after `SETTLE`; NaN before."""
        return float(np.mean(self._errors)) if self._errors else float("nan")

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Distinguishes the environments of a runner in the first reset. Later seeds are
                ignored, since RLlib may repeat a seed and would repeat its episodes.
            options: Not used.
        """
        own = None
        if not self._begun:
            drawn = np.random.SeedSequence((*self._place, seed or 0)).generate_state(1, np.uint64)
            own = OWN_SEEDS | int(drawn[0])
            self._begun = True
        self._errors = []
        return super().reset(seed=own)

    def step(self, action_dict: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
        """See `FormationMultiAgentEnv.step`."""
        found = super().step(action_dict)
        formation = self.env.formation
        if formation.cycles[0] * DECISION > SETTLE:
            errors = formation.task.error[0][formation.state.present[0]]
            self._errors.append(float(errors.mean()))
        return found


def _only(values: Mapping[str, Any], agents: list[str]) -> dict[str, Any]:
    return {a: values[a] for a in agents}


def _made_again() -> bool:
    """Return whether this process replaces a lost actor."""
    if not ray.is_initialized():
        return False
    context = ray.get_runtime_context()
    return context.get_actor_id() is not None and bool(context.was_current_actor_reconstructed)
