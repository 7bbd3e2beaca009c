"""Interface of compiled code to the rigid-body solver.

Through the interface of pymunk a step is Python that calls C three times, which takes several
times as long as the solver itself and blocks other threads. Here, arrays hold the addresses of
the same C functions, those behind `Space.step` and `pymunk.batch`, and the structures that they
read and fill, and a kernel (`_contact_kernels`) makes the step.

Addresses are valid in one process and for one memory location: copies begin without any. All code
that depends on private parts of pymunk is in this file. If a version of pymunk has another layout,
`UNKNOWN` describes the difference, and `PhysicsSpace.step` makes the steps.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pymunk
import pymunk.batch
from numpy.typing import NDArray

from relpos_env.world.pymunk_space import N_WALLS, PhysicsSpace
from tracking.arrays import F64, I64

N_STATE, N_INPUT, N_TOUCH = 6, 9, 3
"""Number of values per body read, per body written and per contact."""
_BATCH = (("ints", "u8"), ("floats", "u8"), ("fields", "u4"), ("pad", "u4"))
"""Layout of `pmBatchedData`: pointers to two arrays, and the mask of fields."""
_ARRAY = (("num", "i4"), ("max", "i4"), ("arr", "u8"))
"""Layout of `pmFloatArray` and `pmIntArray`: used length, capacity and data pointer."""
_WAYS = ("put", "got", "met")
SOLVER = np.dtype(
    [
        ("ready", "i8"),  # step that the space can make next; -1 for none
        ("moves", "i8"),  # steps made by all spaces together
        ("fresh", "i8"),  # 1: the space has not made a step yet
        ("space", "u8"),
        # Addresses of functions.
        ("step", "u8"),
        ("each_body", "u8"),
        ("each_contact", "u8"),
        ("put", "u8"),
        ("get", "u8"),
        ("tell", "u8"),
        # Addresses of the structures below.
        *((f"{way}_data", "u8") for way in _WAYS),
        *((f"{way}_{name}", kind) for way in _WAYS for name, kind in (*_BATCH, *_ARRAY)),
    ]
)


_OFFSETS = {name: at for name, (_, at, *_) in (SOLVER.fields or {}).items()}


class Solver(NamedTuple):
    """Data of the kernels for steps of the solver, arrays over (env, ...)."""

    calls: NDArray[Any]
    """SOLVER, (env)."""
    bodies: F64
    """Position, angle, velocities, force and torque of cars, movable boxes and the room itself,
    (env, row, N_INPUT)."""
    moved: F64
    """Position, angle and velocities after the step, (env, row, N_STATE)."""
    met: I64
    """IDs of the two bodies of a contact, and 1 if it is new, (env, contact, N_TOUCH)."""
    car_ids: I64
    """Body ID of each car in the solver, 0 for absent cars, (env, car)."""
    owner: I64
    """Owner of each row of `bodies`: a car, a box (its index plus the number of cars), or -1 for
    static bodies, (env, row)."""


def make_solver(n_envs: int, n_cars: int, n_boxes: int) -> Solver:
    """Return the arrays of a solver without connected spaces."""
    # No array may ever be too small: the C code would reallocate it. It keeps one row free.
    n_bodies = n_cars + n_boxes
    n_met = n_bodies * (n_bodies - 1) // 2 + n_bodies * N_WALLS + 1
    solver = Solver(
        calls=np.zeros(n_envs, dtype=SOLVER),
        bodies=np.zeros((n_envs, n_bodies + 2, N_INPUT)),
        moved=np.zeros((n_envs, n_bodies + 2, N_STATE)),
        met=np.zeros((n_envs, n_met, N_TOUCH), dtype=np.int64),
        car_ids=np.zeros((n_envs, n_cars), dtype=np.int64),
        owner=np.full((n_envs, n_bodies + 2), -1, dtype=np.int64),
    )
    solver.calls["ready"] = -1
    return solver


def connect(solver: Solver, env: int, world: PhysicsSpace, tick: int) -> None:
    """Connect a space to compiled code, which then steps it.

    Args:
        solver: Solver, written.
        env: Index of the environment.
        world: Space; the caller must keep it as long as it is connected.
        tick: Number of the first step to make.
    """
    calls = solver.calls[env]
    calls["ready"], calls["space"], calls["fresh"] = tick, _PRIVATE.address(world.space._space), 1
    for name, function in _PRIVATE.functions.items():
        calls[name] = function
    start = solver.calls.ctypes.data + env * solver.calls.strides[0]
    _describe(calls, "put", start, "floats", _PRIVATE.fields_put, solver.bodies[env])
    _describe(calls, "got", start, "floats", _PRIVATE.fields_got, solver.moved[env])
    _describe(calls, "met", start, "ints", _PRIVATE.fields_met, solver.met[env])
    solver.car_ids[env] = 0
    owners = {body.id: n for n, body in world.cars.items()}
    for number, car in owners.items():
        solver.car_ids[env, car] = number
    n_cars = solver.car_ids.shape[1]
    owners |= {body.id: n_cars + k for k, body in world.boxes.items()}
    ids = pymunk.batch.Buffer()
    pymunk.batch.get_space_bodies(world.space, pymunk.batch.BodyFields.BODY_ID, ids)
    solver.owner[env] = -1
    for row, number in enumerate(memoryview(ids.int_buf()).cast("P")):
        solver.owner[env, row] = owners.get(number, -1)


def disconnect(solver: Solver, env: int) -> None:
    """Disconnect the space of an environment from compiled code."""
    solver.calls["ready"][env] = -1


def _describe(
    calls: Any, way: str, start: int, which: str, fields: int, array: NDArray[Any]
) -> None:
    """Fill in the structures of one transfer to or from the solver, with `array` as memory."""
    calls[f"{way}_data"] = start + _OFFSETS[f"{way}_ints"]
    calls[f"{way}_{which}"] = start + _OFFSETS[f"{way}_num"]
    calls[f"{way}_fields"] = fields
    calls[f"{way}_max"], calls[f"{way}_arr"] = array.size, array.ctypes.data


LAYOUTS = {
    "pmBatchedData": (24, {"intArray": 0, "floatArray": 8, "fields": 16}),
    "pmFloatArray": (16, {"num": 0, "max": 4, "arr": 8}),
    "pmIntArray": (16, {"num": 0, "max": 4, "arr": 8}),
}
"""Size and offsets of the fields of C structures, as in `SOLVER` [bytes]."""


class _Private(NamedTuple):
    """Private parts of a version of pymunk."""

    functions: dict[str, int]
    """Addresses of C functions by field of `SOLVER`."""
    fields_put: int
    fields_got: int
    fields_met: int
    address: Any
    """Function that returns the address of a C pointer."""


def _find_private() -> _Private:
    """Look up the functions of the solver, and check that its structures have the layout of ours.

    Raises:
        ImportError: The layout differs.
        AttributeError: A function has another name.
    """
    from pymunk._chipmunk_cffi import ffi, lib
    from pymunk.batch import ArbiterFields, BodyFields

    for name, (size, fields) in LAYOUTS.items():
        found = {field: info.offset for field, info in ffi.typeof(name).fields}
        if ffi.sizeof(name) != size or found != fields:
            raise ImportError(
                f"pymunk {pymunk.version}: expected {name} of {size} bytes with {fields}, "
                f"got {ffi.sizeof(name)} bytes with {found}"
            )

    def address(pointer: Any) -> int:
        return int(ffi.cast("uintptr_t", pointer))

    names = {
        "step": "cpSpaceStep",
        "each_body": "cpSpaceEachBody",
        "each_contact": "cpSpaceEachCachedArbiter",
        "put": "pmSpaceBodySetIteratorFuncBatched",
        "get": "pmSpaceBodyGetIteratorFuncBatched",
        "tell": "pmSpaceArbiterIteratorFuncBatched",
    }
    state = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY
    state |= BodyFields.ANGULAR_VELOCITY
    touch = ArbiterFields.BODY_A_ID | ArbiterFields.BODY_B_ID | ArbiterFields.IS_FIRST_CONTACT
    return _Private(
        {field: address(ffi.addressof(lib, name)) for field, name in names.items()},
        (state | BodyFields.FORCE | BodyFields.TORQUE).value,
        state.value,
        touch.value,
        address,
    )


def _find_or_say_why() -> tuple[Any, str]:
    try:
        return _find_private(), ""
    except (ImportError, AttributeError, KeyError, TypeError) as error:
        return None, str(error)


_PRIVATE, UNKNOWN = _find_or_say_why()
"""`UNKNOWN` describes an unexpected pymunk; empty if compiled code can step its spaces."""
