"""A drive in a separate process that prints its state after every control step.

    python drive_process.py CONFIG '{"seconds": 60, ...}'

Orders are JSON lines on stdin: {"order": "arm"}, {"hang": SECONDS}, {"disk": BYTES}.
"""

import json
import resource
import signal
import sys
import threading
import time
from dataclasses import dataclass, field

import agents.hardware.drive.run
from agents.comparison.contender import find_entry
from agents.hardware.drive import drive
from hardware_bridge.errors import BridgeError
from hardware_bridge.safety.gate import reason_text

HANG = [0.0]


class Sleepy:
    """A driver that hangs for a while on request."""

    def __init__(self, driver):
        self.driver = driver

    def act(self, observations):
        seconds, HANG[0] = HANG[0], 0.0
        if seconds:
            say(hangs=seconds)
            time.sleep(seconds)
        return self.driver.act(observations)


@dataclass
class SleepyEntry:
    entry: object

    def __getattr__(self, name):
        return getattr(self.entry, name)

    def driver(self, *args):
        return Sleepy(self.entry.driver(*args))


def say(**fields):
    print(json.dumps({"t_ns": time.monotonic_ns(), **fields}), flush=True)


@dataclass
class Watch:
    orders: list = field(default_factory=list)
    told: int = 0
    started: bool = False

    def __call__(self, bridge, env):
        if not self.started:
            self.started = True
            say(supervisor=bridge.supervisor.process.pid)
        while self.orders:
            self.obey(bridge, self.orders.pop(0))
        feed, report = bridge.feed, bridge.feed.report
        for t_ns, text in feed.notices[self.told :]:
            say(notice=text, at_ns=t_ns)
        self.told = len(feed.notices)
        if report is not None:
            say(
                armed=[bool(v) for v in report.armed],
                reason=[reason_text(int(k)) for k in report.reason],
                well_for=[round(float(v), 3) for v in report.well_for],
                cap=[float(v) for v in report.cap],
                speed=[float(v) for v in report.speed],
                asked=[float(v) for v in env.group.asked[:, 0]],
                missed=report.missed,
                late=feed.n_late,
                finding=not env.agents,
            )

    def obey(self, bridge, order):
        if "order" in order:
            bridge.feed.order(order["order"])
        elif "hang" in order:
            HANG[0] = order["hang"]
        elif "disk" in order:
            # Writes beyond this file size fail as on a full disk.
            _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
            size = order["disk"] if order["disk"] >= 0 else hard
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))


def listen(orders):
    for line in sys.stdin:
        orders.append(json.loads(line))


def main(config, options):
    agents.hardware.drive.run.find_entry = lambda name: SleepyEntry(find_entry(name))
    watch = Watch()
    threading.Thread(target=listen, args=(watch.orders,), daemon=True).start()
    try:
        result = drive(config=config, arm=True, watch=watch, **options)
    except BridgeError as error:
        say(error=str(error))
        sys.exit(2)
    say(summary=result.summary)


if __name__ == "__main__":
    # If the tests run under nohup, ignoring SIGHUP would be inherited.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    main(sys.argv[1], json.loads(sys.argv[2]))
