"""Configuration of a training run; saved with the run, and the source of the options."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from agents.settings import number

MOST_SEED = 2147483647
"""Largest seed (31 bits)."""
FORMAT = 11
"""Version of the run folder; other versions are refused."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvSetup:
    """Environments and observations of the policy."""

    scenarios: tuple[str, ...] = ("cars-nlos", "swarm-nlos")
    """Names or TOML files; the environments are divided equally among them."""
    task: str = "ring"
    """One of `relpos_env.tasks.TASKS`."""
    observation: str = "estimate"
    """One of `relpos_env.interface.observations.OBSERVATIONS`."""
    history: int = number(1, 1, 64)
    """Number of stacked observations, the newest first."""
    proximity: int = number(0, 0, 32)
    """Number of distance sensors around each car, which measure walls, boxes and cars."""
    trackers: Literal["group", "own"] = "group"
    """One tracker of the group, or one on each car, see `relpos_env.config`."""
    cars: int = number(6, 2, 20)
    """Number of car slots, 2 to 20: the largest group that the policy can drive, at least the
    cars of the scenarios."""
    operator: float = number(0.5, 0, 1)
    """Share of episodes with an operator, whose corrections are based on true positions. In the
    other episodes cars only follow the plan, as real cars without a remote control do."""
    levels: tuple[int, ...] = field(default=(), metadata={"low": 0, "high": 4})
    """Curriculum of randomisation levels, 0 to 4, each for an equal share of the training; the
    scenarios are used as they are if none is given."""
    seconds: float = number(30.0, 12, 3600)
    """[s] Length of an episode."""
    weights: tuple[str, ...] = ("collision=5",)
    """Weights of reward terms that differ from those of the task, TERM=WEIGHT."""
    final_weights: tuple[str, ...] = ()
    """Final weights of reward terms, TERM=WEIGHT: reached linearly between 25 % and 50 % of the
    run, and used by all evaluations. Anneals shaping rewards, and raises the cost of collisions
    late in training."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Networks:
    """Shapes of actor and critic."""

    width: int = number(64, 4, 1024)
    """Units of each layer."""
    depth: int = number(2, 1, 6)
    """Layers applied to each other car, before the mean."""
    layers: int = number(2, 1, 6)
    """Layers after the mean."""
    critic: Literal["own", "central"] = "own"
    """Input of the critic: the car's observation, or also the ground truth of all cars."""
    log_std: float = number(-1.0, -5, 1)
    """[-] Initial logarithm of the standard deviation of actions."""
    final_log_std: float = number(-2.3, -5, 1)
    """[-] Upper limit at the end. The limit falls linearly from `log_std` between 50 % and 70 %
    of the run, since deployed policies act without this noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ppo:
    """Proximal policy optimisation (Schulman et al., arXiv 1707.06347)."""

    envs: int = number(64, 1, 4096)
    """Number of parallel environments."""
    steps: int = number(64, 8, 4096)
    """Control steps of each environment between two updates."""
    batch: int = number(2048, 16, 1048576)
    """Transitions per gradient step."""
    epochs: int = number(5, 1, 100)
    """Passes over the transitions of an update."""
    reward_scale: float = number(0.05, 1e-06, 1000)
    """[-] Factor of the rewards for the learner only. Scales returns to about 1; otherwise the
    value loss dominates the clipped gradient."""
    learning_rate: float = number(1e-3, 1e-07, 1)
    """[-] Initial learning rate; decays to 1 % of it along half a cosine."""
    gamma: float = number(0.95, 0, 1)
    """[-] Discount factor per control step of 0.1 s; 0.95 is a horizon of 2 s."""
    gae_lambda: float = number(0.9, 0, 1)
    """[-] Decay of the generalised advantage estimate."""
    clip: float = number(0.2, 0.01, 1)
    """[-] Largest relative change of an action's probability by an update."""
    entropy: float = number(0.0, 0, 1)
    """[-] Weight of the entropy bonus."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainConfig:
    """A training run."""

    frames: int = number(6_000_000, 1000, 1000000000000)
    """Agent steps of a run, those of absent cars included, rounded up to whole updates."""
    runs: int = number(1, 1, 64)
    """Number of parallel runs, with seeds from `seed` on, each in its own process; the best policy
    of all runs is kept."""
    begin: str = ""
    """Policy that provides the initial network: a name, a file or a folder. Its task, observation
    and shape must be those of the run. Only the critic is trained in the first 10 % of the run."""
    seed: int = number(0, 0, MOST_SEED)
    """Seed; reproduces weights bit for bit on one machine with equal versions and threads."""
    eval_interval: int = number(40, 1, 10000)
    """Updates per evaluation interval, which begins with new episodes."""
    threads: int = number(2, 1, 256)
    """Threads for simulation and learning, divided among the runs."""
    eval_episodes: int = number(24, 1, 500)
    """Episodes that determine the best policy after each evaluation interval, divided among the
    scenarios; always the same."""
    choice_episodes: int = number(200, 1, 10000)
    """Held-out episodes that select the final policy among the best and the last of each run."""
    choice_scenarios: tuple[str, ...] = ()
    """Held-out scenarios, each with the same share of the selection episodes as a training
    scenario; they measure generalisation to other rooms."""
    env: EnvSetup = field(default_factory=EnvSetup)
    net: Networks = field(default_factory=Networks)
    ppo: Ppo = field(default_factory=Ppo)

    def of_run(self, k: int) -> TrainConfig:
        """Return the configuration of one of the parallel runs."""
        threads = max(self.threads // self.runs, 1)
        return replace(self, runs=1, seed=self.seed + k, threads=threads)
