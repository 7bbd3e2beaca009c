"""`relpos policy`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from agents.cli.console import emit_json, print_table
from agents.cli.options import json_option

if TYPE_CHECKING:
    from agents.policies import Card


@click.group()
def policy() -> None:
    """List trained policies and show their cards."""


@policy.command("list")
@json_option
def list_policies(as_json: bool) -> None:
    """List the policies shipped with the package."""
    from agents.policies import load_policy, shipped_names

    cards = [load_policy(name).card for name in shipped_names()]
    if as_json:
        emit_json(_short(card) for card in cards)
        return
    if not cards:
        click.echo("no policies come with this version; a file or a folder does as well")
        return
    rows = [[str(value) for value in _short(card).values()] for card in cards]
    print_table("Policies", ["name", "observation", "cars", "history", "rangefinders"], rows)


@policy.command("show")
@click.argument("name_or_path", metavar="NAME_OR_PATH")
@click.option(
    "--json", "as_json", is_flag=True, help="Print the card as one JSON object, nothing else."
)
def show(name_or_path: str, as_json: bool) -> None:
    """Check a policy and print its card."""
    from agents.policies import load_policy

    card = load_policy(name_or_path).card
    if as_json:
        emit_json([json.loads(card.to_json())])
        return
    click.echo(f"Policy {card.name}\n")
    for key, value in _facts(card):
        click.echo(f"  {key}: {value}")
    click.echo()
    rows = [
        [f"{r['first']} to {r['last']}", r["name"], r["unit"], f"{r['low']:g} to {r['high']:g}"]
        for r in card.layout.index
    ]
    print_table("One observation", ["index", "field", "unit", "limits"], rows)


def _short(card: Card) -> dict[str, Any]:
    """Return the record of a policy in a list."""
    layout = card.layout
    return {
        "name": card.name,
        "observation": layout.observation,
        "n_cars": layout.n_cars,
        "history": layout.history,
        "proximity": layout.proximity,
    }


def _facts(card: Card) -> list[list[str]]:
    """Return the entries of a card as rows of name and value."""
    rows = [
        ["observation", card.layout.describe()],
        ["numbers in it", str(card.layout.size)],
        ["layout", card.layout.digest],
        ["speed of an action of 1", f"{card.max_speed:g} m/s"],
        ["steering of an action of 1", f"{card.max_steering:g} rad"],
        ["a decision every", f"{card.decision:g} s"],
        ["network (SHA-256)", card.onnx_sha256],
    ]
    rows += [[f"training: {_text(key)}", _text(value)] for key, value in card.training.items()]
    for k, result in enumerate(card.results):
        rows += [[f"result {k + 1}: {_text(key)}", _text(value)] for key, value in result.items()]
    return rows


def _text(value: Any) -> str:
    """Return a value on one line, with control characters of a card escaped for the terminal."""
    return json.dumps(value).strip('"')
