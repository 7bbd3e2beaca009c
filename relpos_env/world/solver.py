"""The rigid-body solver as compiled code calls it.

Through the interface of pymunk a step is Python that calls C three times, which takes several
times as long as the solver's own work and keeps other threads waiting. Here the addresses of the
same C functions, those behind `Space.step` and `pymunk.batch`, and the structures that they read
and fill stand in arrays, and a kernel (`_contact_kernels`) makes the step.

Addresses hold for one process, and for one place in memory: copies begin without any. All that is
private to pymunk is in this file. If a version of pymunk lays it out otherwise, `UNKNOWN` says how,
and `PhysicsSpace.step` makes the steps.
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
"""Numbers of a body that is read, of one that is written, and of a contact."""
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
    owner: I64
    """What the rows of `bodies` are: a car, a box (its number plus that of all cars), or -1 for
    what does not move, (env, row)."""


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
        owner=np.full((n_envs, n_bodies + 2), -1, dtype=np.int64),
    )
    solver.calls["ready"] = -1
    return solver


def connect(solver: Solver, env: int, world: PhysicsSpace, tick: int) -> None:
    """Let compiled code step the space of a world.

    Args:
        solver: Written.
        env: Which.
        world: Must be kept by the caller as long as it is connected.
        tick: The step that is to be made first.
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


LAYOUTS = {
    "pmBatchedData": (24, {"intArray": 0, "floatArray": 8, "fields": 16}),
    "pmFloatArray": (16, {"num": 0, "max": 4, "arr": 8}),
    "pmIntArray": (16, {"num": 0, "max": 4, "arr": 8}),
}
"""Size and offsets of the fields of C structures, as `SOLVER` has them [bytes]."""


class _Private(NamedTuple):
    """What is private to a version of pymunk."""

    functions: dict[str, int]
    """Addresses."""
    fields_put: int
    fields_got: int
    fields_met: int
    address: Any
    """Of a C pointer."""


def _find_private() -> _Private:
    """Look up the functions of the solver, and see that its structures are laid out like ours.

    Raises:
        ImportError: They are not.
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
"""`UNKNOWN` says what of pymunk is not as expected; empty if compiled code can step its spaces."""
