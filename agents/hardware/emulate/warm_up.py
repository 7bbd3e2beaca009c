"""A run before the run, so that what is compiled is loaded when time begins to count."""

from __future__ import annotations

from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.rig import EmulatedRig
from hardware_bridge.drivers import make_driver
from hardware_bridge.emulator.ports import MemoryPort
from relpos_env.interface.actions import MAX_SPEED
from relpos_env.timing import DT, STAND_STILL

STEPS = round((STAND_STILL + 3.0) / DT)
"""[-] Long enough for cars to meet a wall."""


def warm_up(options: EmulateOptions) -> None:
    """Drive the cars about in memory.

    Args:
        options: Of the run that is to come.
    """
    rig = EmulatedRig(options)
    key = options.car_key
    drivers = [
        make_driver(options.driver, node, options.driver_options, key, 1, lambda: 0)
        for node in rig.constellation.ids
    ]
    for _ in range(STEPS):
        for car, driver in zip(rig.emulator.cars, drivers, strict=True):
            port = car.line.port
            assert isinstance(port, MemoryPort)
            port.send(driver.drive(MAX_SPEED, 0.0) + driver.ask())
        rig.step()
    rig.close()
