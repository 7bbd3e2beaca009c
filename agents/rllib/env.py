"""The environment as RLlib takes it: cars that join, leave and return in mid-episode.

RLlib's own wrapper of PettingZoo environments takes the agents of the first moment for those of
the whole episode, and fails when one joins or leaves. Here an agent is asked for an action only
after a step that shows it an observation, which is what RLlib makes of the keys of a dict.
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
"""RLlib's word for the whole episode."""
OWN_SEEDS = 1 << 63
"""Seeds of training are from here on, far from those of comparisons."""


class FormationMultiAgentEnv(MultiAgentEnv):  # type: ignore[misc]
    """`relpos_env.api.parallel_env.FormationEnv` for RLlib; spaces and numbers are the same.

    | a car | in the dicts of a step |
    |---|---|
    | is in the room | as in the PettingZoo form |
    | joins | from that step on |
    | goes, and will return | not there while it is away, so nothing is learnt from it; its reward \
of an absence is 0 |
    | leaves for good | truncated in that step, not there any more |
    | at the end of the episode | all agents, those that are away with zeros |

    Law: a key that is there has the value of the PettingZoo form, bit for bit.
    """

    def __init__(self, arguments: Mapping[str, Any] | None = None) -> None:
        """Build the environment.

        Args:
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
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
            action_dict: Of every agent that was shown an observation in the step before.

        Raises:
            EnvError: As `FormationEnv.step`.
        """
        env = self.env
        # What a car that is away does has no effect, but the environment wants to hear something.
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
        """Some action of its space."""
        space = self.action_spaces[agent]
        return np.zeros(space.shape, dtype=space.dtype)


class SeededEnv(FormationMultiAgentEnv):
    """The environment with seeds of its own, for env runners.

    RLlib gives environment i of runner w the seed s + w + i, so runners would share episodes, and
    the seeds of many runners would reach those of comparisons.
    """

    def __init__(self, context: Any) -> None:
        """Build an environment of one runner.

        Args:
            context: RLlib's `EnvContext`: ``arguments`` as above and ``seed``.
        """
        super().__init__(context["arguments"])
        # A runner that was lost and made again goes on with other episodes.
        again = os.getpid() if context.recreated_worker or _made_again() else 0
        self._place = context["seed"], context.worker_index or 0, again
        self._begun = False
        self._errors: list[float] = []

    @property
    def formation_error(self) -> float:
        """[m] Of the episode so far, mean over cars and the time from `SETTLE` on; NaN before."""
        return float(np.mean(self._errors)) if self._errors else float("nan")

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Tells the environments of a runner apart. What it says later is not heard: RLlib
                may say the same again, and means the same episodes by it.
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
    """Whether this process stands in for an actor that was lost."""
    if not ray.is_initialized():
        return False
    context = ray.get_runtime_context()
    return context.get_actor_id() is not None and bool(context.was_current_actor_reconstructed)
