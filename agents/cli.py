"""The command line `relpos`. Imports of a command happen when it runs, so that help is quick."""

from __future__ import annotations

import sys

import click

from agents.commands.bench import bench
from agents.commands.calibrate import calibrate
from agents.commands.compare import compare
from agents.commands.convert import convert
from agents.commands.demo import demo
from agents.commands.demo_hardware import demo_hardware
from agents.commands.doctor import doctor
from agents.commands.drive import drive
from agents.commands.emulate import emulate
from agents.commands.evaluate import evaluate
from agents.commands.export import export
from agents.commands.live import live
from agents.commands.policy import policy
from agents.commands.protocol import protocol
from agents.commands.replay import replay
from agents.commands.rllib import rllib
from agents.commands.simulate import simulate
from agents.commands.sniff import sniff
from agents.commands.track import track
from agents.commands.train import train
from agents.commands.warmup import warmup
from agents.errors import UsageError


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="relpos-env", prog_name="relpos")
def cli() -> None:
    """Relative positions without anchors: track, simulate, drive in formation, measure."""


for command in (
    track,
    calibrate,
    simulate,
    convert,
    demo,
    emulate,
    drive,
    demo_hardware,
    evaluate,
    compare,
    train,
    export,
    policy,
    rllib,
    protocol,
    doctor,
    sniff,
    live,
    replay,
    bench,
    warmup,
):
    cli.add_command(command)


def main() -> None:
    """Run the command line; what a user can mend ends in one line and status 2."""
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
    """True for errors that say what a user can mend."""
    # The packages take longer to import than help takes to print.
    from hardware_bridge.errors import BridgeError
    from relpos_env.errors import EnvError
    from tracking.errors import TrackingError

    return isinstance(error, (TrackingError, EnvError, BridgeError, UsageError, OSError))


if __name__ == "__main__":
    main()
