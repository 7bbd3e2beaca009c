"""Test formats: ``name device to distance #sum``, and a device at a pseudo terminal."""

import os
import threading
import tty
from dataclasses import dataclass, field

from hardware_bridge.counts import Counts
from hardware_bridge.readings import ImuReading, RangeReading, Source


def line(name, device, to, distance, sequence=None, boot=1):
    tail = "" if sequence is None else f" {boot} {sequence}"
    body = f"{name} {device} {to} {distance}{tail}"
    return f"{body} #{sum(body.encode()) % 256}\n".encode()


@dataclass
class LineDecoder:
    name: str
    counts: Counts = field(default_factory=Counts)
    rest: bytes = b""

    @property
    def waiting(self):
        return len(self.rest)

    def feed(self, data):
        self.counts.n_bytes += len(data)
        *lines, self.rest = (self.rest + data).split(b"\n")
        self.rest = self.rest[-4096:]
        return [reading for each in lines for reading in self._read(each)]

    def _read(self, each):
        if not each.startswith(self.name.encode() + b" "):
            self.counts.strange += len(each) + 1
            return
        body, _, check = each.rpartition(b" #")
        if not check.isdigit() or sum(body) % 256 != int(check):
            self.counts.damaged += 1
            return
        self.counts.frames += 1
        _, device, to, distance, *tail = body.decode().split()
        boot, sequence = map(int, tail) if tail else (None, None)
        source = Source(None if device == "-" else device, boot, sequence)
        if to == "imu":
            yield ImuReading(source, (0.0, 0.0, 0.0), (0.0, 0.0, float(distance)))
        else:
            yield RangeReading(source, to, float(distance))


@dataclass
class LineFormat:
    name: str
    baud: int
    keyed: bool = False
    request: bytes = b""
    dtr: bool = True

    def build(self, key):
        assert key is None or self.keyed
        return LineDecoder(self.name)


FORMATS = {"alpha": LineFormat("alpha", 115200), "beta": LineFormat("beta", 921600)}


class Talker:
    """A thread that sends the same bytes repeatedly."""

    def __init__(self, said=None, every=0.01):
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)  # else the terminal echoes bytes sent before any reader opens it
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self.slave)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._talk, args=(said, every))
        self._thread.start()

    def _talk(self, said, every):
        k = 0
        while said is not None and not self._end.wait(every):
            try:
                os.write(self.master, said(k))
            except BlockingIOError:
                continue
            k += 1

    def heard(self):
        try:
            return os.read(self.master, 4096)
        except BlockingIOError:
            return b""

    def close(self):
        self._end.set()
        self._thread.join()
        os.close(self.master)
        os.close(self.slave)
