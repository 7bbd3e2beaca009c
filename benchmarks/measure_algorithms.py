"""Four algorithms of BenchMARL and a controller on the tasks of protocol 1.

For `docs/benchmarks/results.md`. Every run trains a policy that all cars share for `FRAMES`
decisions of the group, then drives episodes of the protocol. All algorithms have `SETTINGS` and
BenchMARL's defaults otherwise; none was tuned.

Run `make build/benchmarl/.installed`, then `PYTHONPATH=build/benchmarl:. .venv/bin/python
benchmarks/measure_algorithms.py [JOBS]`; two and a half hours on two cores. It adds what is missing
in `benchmarks/results/algorithms.jsonl` and writes `algorithms.json` with it, which marl-eval
reads.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from agents.comparison.contender import find_entry
from agents.comparison.meter import Meter
from agents.comparison.protocol import protocol_arguments
from agents.comparison.simulated import Simulated
from relpos_env.config import configure

RESULTS = Path(__file__).parent / "results"
LINES, MARL_EVAL = RESULTS / "algorithms.jsonl", RESULTS / "algorithms.json"
PROTOCOL = protocol_arguments("1")
ALGORITHMS = ("mappo", "ippo", "masac", "qmix")
CONTROLLER = "consensus"
SEEDS = range(5)
FRAMES = 153_600
"""[-] Decisions of a group in a training: twelve episodes of 20 s in each of 64 environments."""
EPISODES = 32
CYCLES, TRAINED_CYCLES = 600, 200
HIDDEN = (128, 128)
SETTINGS: dict[str, Any] = {
    "max_n_frames": FRAMES, "gamma": 0.99, "lr": 1e-3, "loggers": [], "render": False,
    "evaluation_interval": 76_800, "evaluation_episodes": 16,
    "on_policy_collected_frames_per_batch": 3_200, "on_policy_n_envs_per_worker": 64,
    "on_policy_n_minibatch_iters": 10, "on_policy_minibatch_size": 800,
    "off_policy_collected_frames_per_batch": 3_200, "off_policy_n_envs_per_worker": 64,
    "off_policy_train_batch_size": 256, "off_policy_n_optimizer_steps": 40,
    "off_policy_memory_size": 200_000,
}  # fmt: skip
METRICS = "formation_error", "tracking_error", "collisions_per_min"


def train(algorithm: str, task: str, seed: int, folder: Path) -> dict[str, Any]:
    """Train, drive, and return the line of a run."""
    import torch
    from benchmarl.algorithms import algorithm_config_registry
    from benchmarl.experiment import Experiment, ExperimentConfig
    from benchmarl.models.mlp import MlpConfig
    from tensordict import TensorDict
    from torchrl.envs.utils import ExplorationType, set_exploration_type

    from relpos_env.api.benchmarl_tasks import RelposTask

    torch.set_num_threads(1)
    config = ExperimentConfig.get_from_yaml()
    for name, value in {**SETTINGS, "save_folder": str(folder)}.items():
        setattr(config, name, value)
    model = MlpConfig.get_from_yaml()
    model.num_cells = list(HIDDEN)
    made = RelposTask[task.upper()].get_from_yaml()
    made.config["max_cycles"] = TRAINED_CYCLES
    experiment = Experiment(
        task=made,
        algorithm_config=algorithm_config_registry[algorithm].get_from_yaml(),
        model_config=model,
        critic_model_config=model,
        seed=seed,
        config=config,
    )
    begun = time.perf_counter()
    experiment.run()
    trained = time.perf_counter() - begun

    def act(observations: Any) -> Any:
        seen = TensorDict({"agents": {"observation": torch.from_numpy(observations)}}, [EPISODES])
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            return experiment.policy(seen)["agents", "action"].numpy()

    (written,) = folder.rglob("*.json")
    steps = next(iter(json.loads(written.read_text())["relpos"][task][algorithm].values()))
    steps.pop("absolute_metrics", None)
    actions = "discrete" if algorithm == "qmix" else "continuous"
    return {"steps": steps, "training_s": round(trained), **drive(act, task, actions)}


def control(task: str) -> dict[str, Any]:
    """Return the line of the controller, which is not trained."""
    parts = configure({"task": task})
    driver = find_entry(CONTROLLER).driver("estimate", parts.n_cars, 0)
    return drive(lambda seen: np.stack([driver.act(x) for x in seen]), task, "continuous")


def drive(act: Any, task: str, actions: str) -> dict[str, Any]:
    """Return the metrics of the episodes of the protocol, a list each."""
    parts = configure({"task": task, "actions": actions, "max_cycles": CYCLES})
    seeds = range(PROTOCOL["first_seed"], PROTOCOL["first_seed"] + EPISODES)
    running = Simulated(parts, seeds)
    meter, returns = Meter(running), np.zeros(EPISODES)
    while meter.going.any():
        going = meter.going.copy()
        running.step(act(running.observations.copy()))
        core = running.formation
        cars = np.maximum(core.active.sum(axis=1), 1)
        returns += going * np.where(core.active, core.rewards, 0.0).sum(axis=1) / cars
        meter.read()
    found = [meter.result(e, s, round(PROTOCOL["settle"] / 0.1)) for e, s in enumerate(seeds)]
    metrics = {name: [round(float(getattr(r, name)), 4) for r in found] for name in METRICS}
    metrics["return"] = [round(float(x), 3) for x in returns]
    return {"metrics": metrics}


def measured() -> list[dict[str, Any]]:
    """Return the lines so far."""
    return [json.loads(line) for line in LINES.read_text().splitlines()] if LINES.exists() else []


def run(algorithm: str, task: str, seed: int) -> None:
    """Add one run, in a process of its own."""
    command = [sys.executable, __file__, algorithm, task, str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print(done.stderr[-2000:], flush=True)
        return
    line = done.stdout.splitlines()[-1]
    with LINES.open("a", encoding="utf-8") as file:
        file.write(line + "\n")
    found = json.loads(line)
    error = np.nanmean(found["metrics"]["formation_error"])
    print(f"{algorithm} {task} {seed}: {error:.3f} m, {found.get('training_s', 0)} s", flush=True)


def write_marl_eval(lines: list[dict[str, Any]]) -> None:
    """Write the file that marl-eval reads."""
    tasks: dict[str, Any] = {}
    for line in lines:
        runs = tasks.setdefault(line["task"], {}).setdefault(line["algorithm"], {})
        runs[f"seed_{line['seed']}"] = {
            **line.get("steps", {}),
            "absolute_metrics": line["metrics"],
        }
    MARL_EVAL.write_text(json.dumps({"relpos protocol 1": tasks}) + "\n", encoding="utf-8")


def main() -> None:
    """Run what is missing."""
    if len(sys.argv) == 4:
        algorithm, task, seed = sys.argv[1], sys.argv[2], int(sys.argv[3])
        with tempfile.TemporaryDirectory() as folder:
            trained = algorithm != CONTROLLER
            found = train(algorithm, task, seed, Path(folder)) if trained else control(task)
        print(json.dumps({"algorithm": algorithm, "task": task, "seed": seed, **found}))
        return
    jobs = int(sys.argv[1]) if len(sys.argv) == 2 else 2
    have = {(line["algorithm"], line["task"], line["seed"]) for line in measured()}
    missing = [(CONTROLLER, task, 0) for task in PROTOCOL["tasks"]]
    missing += [(a, t, s) for s, t, a in product(SEEDS, PROTOCOL["tasks"], ALGORITHMS)]
    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(lambda one: run(*one), [one for one in missing if one not in have]))
    write_marl_eval(measured())


if __name__ == "__main__":
    main()
