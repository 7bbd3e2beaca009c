"""Training runs of one second, for tests."""

import torch

from agents.settings import from_options
from agents.training.config import TrainConfig
from agents.training.run_folder import LAST, RunFolder

SMALL = {
    "frames": "1400", "eval_interval": "2", "envs": "3", "steps": "16", "batch": "64",
    "epochs": "2", "eval_episodes": "2", "choice_episodes": "2", "seconds": "12", "width": "8",
    "threads": "1", "cars": "6",
}  # fmt: skip


def small(**changes):
    return from_options(TrainConfig, {**SMALL, **changes})


def weights(folder, name=LAST):
    return RunFolder(folder).load(name)[0]


def same(a, b):
    assert a.keys() == b.keys()
    return all(torch.equal(a[k], b[k]) for k in a)
