"""Model card of a policy: observation layout, meaning of actions, training, and results.

Parsing is strict: missing or unknown keys, values of a wrong type and layouts of other versions
are refused, so that a policy never runs on observations with another meaning.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any

from agents.errors import UsageError
from agents.policies.errors import PolicyError
from agents.policies.layout import Layout
from agents.policies.strict_json import Reader, parse_json
from relpos_env.errors import EnvError
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.timing import DECISION

FORMAT = 1
"""Version of the card's format."""
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
"""Permitted names of policies."""
NAME_TEXT = "a name of letters, digits, '.', '-' and '_', 64 at most, a letter or digit first"
HASH = re.compile(r"[0-9a-f]{64}")
KEYS = (
    "format", "name", "layout", "actions", "decision_s", "onnx_sha256", "training", "results",
)  # fmt: skip
LAYOUT_KEYS = ("observation", "n_cars", "history", "proximity", "digest", "index")
ACTION_KEYS = ("kind", "max_speed_m_s", "max_steering_rad")
INDEX_KEYS: dict[str, type] = {
    "first": int, "last": int, "name": str, "unit": str, "low": float, "high": float,
    "meaning": str,
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """Metadata of a policy's network."""

    name: str
    """Name: letters, digits, dots, hyphens and underscores, 64 at most."""
    layout: Layout
    """Layout of the network's observations."""
    onnx_sha256: str = ""
    """SHA-256 of the network's file, in hexadecimal; set by `write_policy`."""
    actions: str = "continuous"
    """Action mode; only `continuous` is supported."""
    max_speed: float = MAX_SPEED
    """[m/s] Speed of an action of 1."""
    max_steering: float = MAX_STEERING
    """[rad] Steering angle of an action of 1; left is positive."""
    decision: float = DECISION
    """[s] Control period."""
    training: dict[str, Any]
    """Record of the trainer: command, configuration, seed, frames, versions."""
    results: tuple[dict[str, Any], ...] = ()
    """Records of evaluations."""

    def to_json(self) -> str:
        """Return the text of the card's file.

        Raises:
            PolicyError: A value is not JSON, or not permitted in a card.
        """
        record = {
            "format": FORMAT,
            "name": self.name,
            "layout": {
                "observation": self.layout.observation,
                "n_cars": self.layout.n_cars,
                "history": self.layout.history,
                "proximity": self.layout.proximity,
                "digest": self.layout.digest,
                "index": self.layout.index,
            },
            "actions": {
                "kind": self.actions,
                "max_speed_m_s": self.max_speed,
                "max_steering_rad": self.max_steering,
            },
            "decision_s": self.decision,
            "onnx_sha256": self.onnx_sha256,
            "training": self.training,
            "results": list(self.results),
        }
        try:
            text = json.dumps(record, indent=2, allow_nan=False) + "\n"
        except (TypeError, ValueError, RecursionError) as error:
            raise PolicyError(self.name, f"the card cannot be written: {error}") from error
        Card.from_json(text, self.name)
        return text

    @classmethod
    def from_json(cls, text: str | bytes, where: str = "card") -> Card:
        """Read a card.

        Args:
            text: Text of the file.
            where: Name of the card in errors.

        Raises:
            PolicyError: The text is not a card, or its version or layout is another.
        """
        card = Reader(parse_json(text, where), where)
        # The version is checked first: the keys of other versions are not known.
        card.has("format")
        version = card.whole("format")
        if version != FORMAT:
            card.refuse("format", f"expected {FORMAT}, got {version}: of another version")
        card.keys(KEYS)
        actions = card.part("actions", ACTION_KEYS)
        if actions.text("kind") != "continuous":
            actions.refuse("kind", f"expected 'continuous', got {actions.text('kind')!a}")
        return cls(
            name=card.matching("name", NAME, NAME_TEXT),
            layout=_layout(card.part("layout", LAYOUT_KEYS, {"proximity": 0})),
            onnx_sha256=card.matching("onnx_sha256", HASH, "64 hexadecimal digits"),
            max_speed=actions.positive("max_speed_m_s"),
            max_steering=actions.positive("max_steering_rad"),
            decision=card.positive("decision_s"),
            training=card.mapping("training"),
            results=tuple(card.mappings("results")),
        )


def check_name(name: str, option: str) -> None:
    """Check the name of a policy, before any work is done for it.

    Raises:
        UsageError: The name is not permitted; names the option.
    """
    if not NAME.fullmatch(name):
        raise UsageError(f"{option}: expected {NAME_TEXT}, for the policy; got {name!a}")


def _layout(part: Reader) -> Layout:
    """Return the layout, checked to equal that of this version."""
    index = part.mappings("index")
    for k, row in enumerate(index):
        reader = Reader(row, f"{part.path('index')}[{k}]", inside=True)
        reader.keys(tuple(INDEX_KEYS))
        for name, kind in INDEX_KEYS.items():
            {int: reader.whole, str: reader.text, float: reader.number}[kind](name)
    digest = part.matching("digest", HASH, "64 hexadecimal digits")
    try:
        layout = Layout(
            part.text("observation"),
            part.whole("n_cars"),
            part.whole("history"),
            part.whole("proximity"),
        )
    except EnvError as error:
        raise part.error("", str(error)) from error
    differences = layout.differences(index)
    if differences:
        part.refuse("index", f"another observation layout: {'; '.join(differences)}")
    if digest != layout.digest:
        part.refuse(
            "digest",
            f"another observation layout: expected {layout.digest} for {layout.describe()}, "
            f"got {digest}",
        )
    return layout
