"""Writing of a policy: both files or none."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

from agents.output import write_results
from agents.policies.card import Card
from agents.policies.errors import PolicyError
from agents.policies.find import MOST_CARD, MOST_NETWORK
from agents.policies.trained import check_policy


def write_policy(folder: Path, name: str, onnx_bytes: bytes, card: Card) -> Card:
    """Write ``name.onnx`` and ``name.json``; existing files are replaced.

    A policy that could not be loaded is not written.

    Args:
        folder: Folder, created if missing.
        name: Name of the policy, also on the card.
        onnx_bytes: Network, including normalisation and limits.
        card: Card; its name and hash of the network are set.

    Returns:
        The written card.

    Raises:
        PolicyError: The policy could not be loaded.
        UsageError: The folder cannot be written to.
    """
    card = replace(card, name=name, onnx_sha256=hashlib.sha256(onnx_bytes).hexdigest())
    text = card.to_json()
    check_policy(onnx_bytes, card, name)
    for what, size, most in (
        ("network", len(onnx_bytes), MOST_NETWORK),
        ("card", len(text.encode()), MOST_CARD),
    ):
        if size > most:
            raise PolicyError(name, f"the {what} has {size} bytes, expected {most} at most")
    write_results(folder, {f"{name}.onnx": onnx_bytes, f"{name}.json": text})
    return card
