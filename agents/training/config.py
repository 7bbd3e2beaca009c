"""Everything that a training run depends on; saved with it, and the source of the options."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from agents.settings import number

MOST_SEED = 2147483647
"""Seeds have 31 bits."""
FORMAT = 10
"""Version of the run folder; another one is refused."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvSetup:
    """What the policy is trained in, and what it sees."""

    scenarios: tuple[str, ...] = ("cars-nlos", "swarm-nlos")
    """Names or TOML files; the environments are shared out among them."""
    task: str = "ring"
    """One of `relpos_env.tasks.TASKS`."""
    observation: str = "estimate"
    """One of `relpos_env.interface.observations.OBSERVATIONS`."""
    history: int = number(1, 1, 64)
    """Observations in one, the newest first."""
    proximity: int = number(0, 0, 32)
    """Beams that measure distances to walls, boxes and cars round each car."""
    cars: int = number(6, 2, 20)
    """Slots for cars, 2 to 20: the policy drives groups of up to so many, at least those of the
    scenarios."""
    operator: float = number(0.5, 0, 1)
    """Share of episodes with an operator, whose trims come from true positions. In the others
    cars follow the plan alone, as real cars without a remote control do."""
    levels: tuple[int, ...] = field(default=(), metadata={"low": 0, "high": 4})
    """Levels of randomisation, 0 to 4, gone through one after the other in equal shares of the
    training; none keeps what the scenarios say."""
    seconds: float = number(30.0, 12, 3600)
    """[s] Length of an episode."""
    weights: tuple[str, ...] = ("collision=5",)
    """Weights of reward terms that differ from the task's own, TERM=WEIGHT."""
    final_weights: tuple[str, ...] = ()
    """Weights that differ from those in the end, TERM=WEIGHT: they go there while a quarter to half
    of the run is done. Policies are judged by these. Anneals shaping rewards, and raises the
    price of collisions late in training."""


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
    """Input of the critic: the car's observation, or the truth of all cars too."""
    log_std: float = number(-1.0, -5, 1)
    """[-] Logarithm of the standard deviation of actions at first."""
    final_log_std: float = number(-2.3, -5, 1)
    """[-] Upper limit at the end. The limit falls linearly from `log_std` between 50 % and 70 %
    of the run, since deployed policies act without this noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ppo:
    """Proximal policy optimisation (Schulman et al., arXiv 1707.06347)."""

    envs: int = number(64, 1, 4096)
    """Environments side by side."""
    steps: int = number(64, 8, 4096)
    """Decisions of each between two updates."""
    batch: int = number(2048, 16, 1048576)
    """Transitions of a gradient step."""
    epochs: int = number(5, 1, 100)
    """Times that every transition is learned from."""
    reward_scale: float = number(0.05, 1e-06, 1000)
    """[-] Rewards are multiplied by it for the learner alone. Scales returns to about 1;
    otherwise the value loss dominates the clipped gradient."""
    learning_rate: float = number(1e-3, 1e-07, 1)
    """[-] At first; falls to a hundredth along half a cosine."""
    gamma: float = number(0.95, 0, 1)
    """[-] Discount of a decision of 0.1 s: 2 s are foreseen."""
    gae_lambda: float = number(0.9, 0, 1)
    """[-] Decay of the generalised advantage estimate."""
    clip: float = number(0.2, 0.01, 1)
    """[-] Largest relative change of a probability by an update."""
    entropy: float = number(0.0, 0, 1)
    """[-] Weight of the entropy bonus."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainConfig:
    """A training run."""

    frames: int = number(6_000_000, 1000, 1000000000000)
    """Decisions of cars until the end of a run, those of absent ones counted; the last leg is
    whole."""
    runs: int = number(1, 1, 64)
    """Runs side by side, with seeds from `seed` on, each in a process of its own; the best policy
    of them is kept."""
    begin: str = ""
    """Policy whose network the run begins with: a name, a file or a folder. Its task, observation
    and shape must be those of the run. A tenth of the frames first teach the critic alone."""
    seed: int = number(0, 0, MOST_SEED)
    """Same seed, same weights, bit for bit on one machine with equal versions and threads."""
    leg: int = number(40, 1, 10000)
    """Updates from checkpoint to checkpoint; each leg begins with new episodes."""
    threads: int = number(2, 1, 256)
    """Threads of simulation and of learning, shared out among the runs."""
    eval_episodes: int = number(24, 1, 500)
    """Episodes after each leg that tell the best policy, shared out among the scenarios, the same
    every time."""
    choice_episodes: int = number(200, 1, 10000)
    """Other episodes, at the end, that tell which policy is kept: the best or the last of a run."""
    choice_scenarios: tuple[str, ...] = ()
    """Scenarios that are not learned in, for as large a share of those episodes as others have:
    what a policy is worth in rooms that are new to it does not show in those it learned in."""
    env: EnvSetup = field(default_factory=EnvSetup)
    net: Networks = field(default_factory=Networks)
    ppo: Ppo = field(default_factory=Ppo)

    def of_run(self, k: int) -> TrainConfig:
        """Of one of the runs side by side."""
        threads = max(self.threads // self.runs, 1)
        return replace(self, runs=1, seed=self.seed + k, threads=threads)
