"""Warm-up run that loads compiled kernels before deadlines apply."""

from __future__ import annotations

from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.rig import EmulatedRig
from hardware_bridge.drivers import make_driver
from hardware_bridge.emulator.ports import MemoryPort
from relpos_env.interface.actions import MAX_SPEED
from relpos_env.timing import DT, STAND_STILL

STEPS = round((STAND_STILL + 3.0) / DT)
"""[-] Number of steps, enough for cars to reach a wall."""


def warm_up(options: EmulateOptions) -> None:
    """Drive the cars in memory.

    Args:
        options: Options of the run to warm up for.
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
