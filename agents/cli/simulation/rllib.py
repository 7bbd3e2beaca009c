"""`relpos rllib`."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from agents.cli.options import scenario_option, task_option
from agents.errors import UsageError


@click.command()
@scenario_option(". By default that of the task.")
@task_option
@click.option(
    "--observation",
    default="estimate",
    show_default=True,
    help="Observation mode: estimate, estimate_cov, ranges or truth.",
)
@click.option("--cars", "n_cars", type=int, help="Number of agent slots, 2 to 20.")
@click.option("--level", type=int, help="Curriculum level of the randomisation, 0 to 4.")
@click.option("--history", default=1, show_default=True, help="Number of stacked observations.")
@click.option("--max-cycles", default=600, show_default=True, help="Steps of an episode.")
@click.option(
    "--iterations",
    default=100,
    show_default=True,
    help="Number of iterations of sampling and learning.",
)
@click.option("--steps", default=4000, show_default=True, help="Environment steps of an iteration.")
@click.option(
    "--workers",
    default=2,
    show_default=True,
    help="Number of env runners, one core each; 0 runs in this process.",
)
@click.option("--envs", default=4, show_default=True, help="Environments of each worker.")
@click.option("--seed", default=0, show_default=True, help="Seed of weights and episodes.")
@click.option("--address", help="Address of a running Ray cluster: auto or host:port.")
@click.option("--out", type=Path, required=True, help="New folder for policy, checkpoint, log.")
def rllib(
    iterations: int,
    steps: int,
    workers: int,
    envs: int,
    seed: int,
    address: str | None,
    out: Path,
    **arguments: Any,
) -> None:
    """Train with RLlib's PPO, on this machine or a cluster; prints one JSON line per iteration.

    Writes policy.onnx with its card, for `relpos compare` and `relpos demo --policy`.
    """
    missing = [name for name in ("ray", "tree", "torch", "onnx") if find_spec(name) is None]
    if missing:
        raise UsageError(
            f"relpos rllib: needs {', '.join(missing)}: pip install -e '.[rllib]', in an "
            "environment of its own"
        )
    from agents.rllib.config import RllibConfig
    from agents.rllib.train import rllib_train

    config = RllibConfig(
        arguments=arguments,
        iterations=iterations,
        steps=steps,
        workers=workers,
        envs=envs,
        seed=seed,
    )
    rllib_train(
        config,
        out,
        address=address,
        progress=lambda record: click.echo(json.dumps(record, allow_nan=False)),
    )
