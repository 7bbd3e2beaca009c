"""The rigid-body solver as compiled code calls it.

Through the interface of pymunk a step is Python that calls C three times, which takes several
times as long as the solver's own work and keeps other threads waiting. Here the addresses of the
same C functions, those behind `Space.step` and `pymunk.batch`, and the structures that they read
and fill stand in arrays, and a kernel (`_contact_kernels`) makes the step.

Addresses hold for one process, and for one place in memory: copies begin without any.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib
from pymunk.batch import ArbiterFields, BodyFields

from relpos_env.room import N_WALLS, Room
from tracking.arrays import F64, I64, Bool

N_STATE, N_INPUT, N_TOUCH = 6, 9, 3
"""Numbers of a body that is read, of one that is written, and of a contact."""
_STATE = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
_INPUT = _STATE | BodyFields.FORCE | BodyFields.TORQUE
_TOUCH = ArbiterFields.BODY_A_ID | ArbiterFields.BODY_B_ID | ArbiterFields.IS_FIRST_CONTACT
_BATCH = (("ints", "u8"), ("floats", "u8"), ("fields", "u4"), ("pad", "u4"))
"""`pmBatchedData`: pointers to two arrays, and which fields are meant."""
_ARRAY = (("num", "i4"), ("max", "i4"), ("arr", "u8"))
"""`pmFloatArray` and `pmIntArray`: numbers there are, room, and where."""
_WAYS = ("put", "got", "met")
SOLVER = np.dtype(
    [
        ("ready", "i8"),  # the step that the space can make next; -1 for none
        ("moves", "i8"),  # steps that were made, by whichever space
        ("fresh", "i8"),  # 1: the space has made none
        ("space", "u8"),
        # Addresses of functions.
        ("step", "u8"),
        ("each_body", "u8"),
        ("each_contact", "u8"),
        ("put", "u8"),
        ("get", "u8"),
        ("tell", "u8"),
        # Addresses of what follows.
        *((f"{way}_data", "u8") for way in _WAYS),
        *((f"{way}_{name}", kind) for way in _WAYS for name, kind in (*_BATCH, *_ARRAY)),
    ]
)


_OFFSETS = {name: at for name, (_, at, *_) in (SOLVER.fields or {}).items()}


class Solver(NamedTuple):
    """What kernels need for the moves of the solver, arrays over (env, ...)."""

    calls: NDArray[Any]
    """SOLVER, (env)."""
    bodies: F64
    """Of cars, boxes that can be pushed and the room itself: position, angle, velocities, force
    and torque, (env, row, N_INPUT)."""
    moved: F64
    """Position, angle and velocities after the step, (env, row, N_STATE)."""
    met: I64
    """The two bodies of a contact, and whether it is new, (env, contact, N_TOUCH)."""
    car_ids: I64
    """The solver's number of each car, 0 for those that it does not have, (env, car)."""
    movable: Bool
    """Boxes that can be pushed, (env, box)."""


def make_solver(n_envs: int, n_cars: int, n_boxes: int) -> Solver:
    """Nothing is connected yet."""
    # Nothing may ever be too small: the C code would move it. It keeps a row's worth of room free.
    n_bodies = n_cars + n_boxes
    n_met = n_bodies * (n_bodies - 1) // 2 + n_bodies * N_WALLS + 1
    solver = Solver(
        calls=np.zeros(n_envs, dtype=SOLVER),
        bodies=np.zeros((n_envs, n_bodies + 2, N_INPUT)),
        moved=np.zeros((n_envs, n_bodies + 2, N_STATE)),
        met=np.zeros((n_envs, n_met, N_TOUCH), dtype=np.int64),
        car_ids=np.zeros((n_envs, n_cars), dtype=np.int64),
        movable=np.zeros((n_envs, n_boxes), dtype=bool),
    )
    solver.calls["ready"] = -1
    return solver


def connect(solver: Solver, env: int, room: Room, tick: int) -> None:
    """Let an environment be moved by the space of a room.

    Args:
        solver: Written.
        env: Which.
        room: Must be kept by the caller as long as it is connected.
        tick: The step that is to be made first.
    """
    calls = solver.calls[env]
    calls["ready"], calls["space"], calls["fresh"] = tick, _address(room.space._space), 1
    for name, function in _FUNCTIONS.items():
        calls[name] = function
    start = solver.calls.ctypes.data + env * solver.calls.strides[0]
    _describe(calls, "put", start, "floats", _INPUT.value, solver.bodies[env])
    _describe(calls, "got", start, "floats", _STATE.value, solver.moved[env])
    _describe(calls, "met", start, "ints", _TOUCH.value, solver.met[env])
    solver.car_ids[env] = 0
    for car, number in room.car_ids.items():
        solver.car_ids[env, car] = number
    solver.movable[env] = False
    solver.movable[env, room.movable] = True


def disconnect(solver: Solver, env: int) -> None:
    """Let an environment be moved by no space, until the next is connected."""
    solver.calls["ready"][env] = -1


def _describe(
    calls: Any, way: str, start: int, which: str, fields: int, array: NDArray[Any]
) -> None:
    """Fill in the structures of one way to or from the solver; the array is its memory."""
    calls[f"{way}_data"] = start + _OFFSETS[f"{way}_ints"]
    calls[f"{way}_{which}"] = start + _OFFSETS[f"{way}_num"]
    calls[f"{way}_fields"] = fields
    calls[f"{way}_max"], calls[f"{way}_arr"] = array.size, array.ctypes.data


def _address(pointer: Any) -> int:
    return int(ffi.cast("uintptr_t", pointer))


def _expect_layout(name: str, size: int, fields: dict[str, int]) -> None:
    """The structures of the solver are laid out like those here.

    Raises:
        ImportError: They are not.
    """
    of_solver = {field: info.offset for field, info in ffi.typeof(name).fields}
    if ffi.sizeof(name) != size or of_solver != fields:
        raise ImportError(
            f"pymunk {pymunk.version}: expected {name} of {size} bytes with {fields}, "
            f"got {ffi.sizeof(name)} bytes with {of_solver}"
        )


_expect_layout("pmBatchedData", 24, {"intArray": 0, "floatArray": 8, "fields": 16})
_expect_layout("pmFloatArray", 16, {"num": 0, "max": 4, "arr": 8})
_expect_layout("pmIntArray", 16, {"num": 0, "max": 4, "arr": 8})
_FUNCTIONS = {
    field: _address(ffi.addressof(lib, name))
    for field, name in {
        "step": "cpSpaceStep",
        "each_body": "cpSpaceEachBody",
        "each_contact": "cpSpaceEachCachedArbiter",
        "put": "pmSpaceBodySetIteratorFuncBatched",
        "get": "pmSpaceBodyGetIteratorFuncBatched",
        "tell": "pmSpaceArbiterIteratorFuncBatched",
    }.items()
}
