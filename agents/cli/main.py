"""The command line `relpos`. Commands import their code when they run, so that help is fast."""

from __future__ import annotations

import sys

import click

from agents.cli.hardware.demo_hardware import demo_hardware
from agents.cli.hardware.doctor import doctor
from agents.cli.hardware.drive import drive
from agents.cli.hardware.emulate import emulate
from agents.cli.hardware.live import live
from agents.cli.hardware.replay import replay
from agents.cli.hardware.sniff import sniff
from agents.cli.measuring.bench import bench
from agents.cli.measuring.warmup import warmup
from agents.cli.simulation.compare import compare
from agents.cli.simulation.demo import demo
from agents.cli.simulation.export import export
from agents.cli.simulation.policy import policy
from agents.cli.simulation.rllib import rllib
from agents.cli.simulation.simulate import simulate
from agents.cli.simulation.train import train
from agents.cli.tracking.calibrate import calibrate
from agents.cli.tracking.convert import convert
from agents.cli.tracking.evaluate import evaluate
from agents.cli.tracking.protocol import protocol
from agents.cli.tracking.track import track
from agents.errors import UsageError

SECTIONS = {
    "Track and evaluate": (track, calibrate, convert, evaluate, protocol),
    "Simulate and train": (simulate, demo, compare, train, export, policy, rllib),
    "Hardware": (doctor, sniff, live, drive, replay, emulate, demo_hardware),
    "Measure": (bench, warmup),
}
"""Commands by section of the help."""


class _Sections(click.Group):
    """A group whose help lists commands by section."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(len(name) for name in self.commands)
        for title, commands in SECTIONS.items():
            limit = formatter.width - 6 - width
            rows = [(str(c.name).ljust(width), c.get_short_help_str(limit)) for c in commands]
            with formatter.section(title):
                formatter.write_dl(rows)


@click.group(cls=_Sections, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="relpos-env", prog_name="relpos")
def cli() -> None:
    """Estimate relative positions without anchors: track, simulate, train, drive."""


for commands in SECTIONS.values():
    for command in commands:
        cli.add_command(command)


def main() -> None:
    """Run the command line; user errors end with a one-line message and status 2."""
    sys.path.append("")  # `package.module:Name` of the current folder, after what is installed
    try:
        cli(standalone_mode=False)
    except click.exceptions.Abort:
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except BrokenPipeError:
        sys.exit(1)
    except Exception as error:
        if not _is_expected(error):
            raise
        click.echo(f"Error: {error}", err=True)
        sys.exit(2)


def _is_expected(error: Exception) -> bool:
    """Return whether an error is a user error."""
    # Importing the packages takes longer than printing the help.
    from hardware_bridge.errors import BridgeError
    from relpos_env.errors import EnvError
    from tracking.errors import TrackingError

    return isinstance(error, (TrackingError, EnvError, BridgeError, UsageError, OSError))


if __name__ == "__main__":
    main()
