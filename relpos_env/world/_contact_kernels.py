"""Steps of an environment by the rigid-body solver, called from compiled code."""

from __future__ import annotations

import math

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from relpos_env.world.pymunk_space import REST
from tracking.kernels.jit import kernel, small_kernel

LASTS = 3
"""[-] Steps for which the solver remembers an ended contact; a contact that recurs within them
is not new."""


def _call(returns, *arguments):
    """Return signature and code of an intrinsic that calls the C function at its first argument."""

    def generate(context, builder, signature, values):
        kinds = [context.get_value_type(kind) for kind in signature.args[1:]]
        function = ir.FunctionType(ir.VoidType(), kinds).as_pointer()
        builder.call(builder.inttoptr(values[0], function), values[1:])
        return context.get_dummy_value()

    return returns(types.uint64, *arguments), generate


@intrinsic
def call_step(context, function, space, dt):
    """Call ``function(space, dt)``, which steps a space."""
    return _call(types.void, types.uint64, types.float64)


@intrinsic
def call_each(context, function, space, visit, data):
    """Call ``function(space, visit, data)``: `visit` for all bodies or contacts of a space."""
    return _call(types.void, types.uint64, types.uint64, types.uint64)


@kernel
def solve(bodies, solver, e, dt):
    """Make one step of an environment with the solver.

    Args:
        bodies: Bodies; the state of cars and boxes and the contacts are updated.
        solver: Solver, with a connected space.
        e: Index of the environment.
        dt: Step [s].
    """
    calls = solver.calls[e]
    put_bodies(bodies, solver, e)
    calls.put_num = 0
    call_each(calls.each_body, calls.space, calls.put, calls.put_data)
    call_step(calls.step, calls.space, dt)
    calls.got_num = 0
    call_each(calls.each_body, calls.space, calls.get, calls.got_data)
    take_bodies(bodies, solver, e)
    calls.met_num = 0
    call_each(calls.each_contact, calls.space, calls.tell, calls.met_data)
    count_contacts(bodies, solver, e, calls.met_num // solver.met.shape[2])
    calls.fresh = 0
    calls.ready += 1
    calls.moves += 1


@small_kernel
def put_bodies(bodies, solver, e):
    """Write the states of bodies and the forces on them, in the order of the space."""
    rows, n_cars = solver.bodies, bodies.body.shape[1]
    for row in range(rows.shape[1]):
        owner = solver.owner[e, row]
        for k in range(rows.shape[2]):
            rows[e, row, k] = 0.0
        if owner >= n_cars:
            for k in range(6):
                rows[e, row, k] = bodies.box_body[e, owner - n_cars, k]
        elif owner >= 0:
            for k in range(6):
                rows[e, row, k] = bodies.body[e, owner, k]
            for k in range(3):
                rows[e, row, 6 + k] = bodies.wrench[e, owner, k]


@small_kernel
def take_bodies(bodies, solver, e):
    """Read the states of bodies after the step."""
    rows, n_cars = solver.moved, bodies.body.shape[1]
    for row in range(rows.shape[1]):
        owner = solver.owner[e, row]
        if owner >= n_cars:
            b, body, at_rest = owner - n_cars, bodies.box_body, True
            for k in range(6):
                body[e, b, k] = rows[e, row, k]
                at_rest = at_rest and (k < 3 or abs(rows[e, row, k]) < REST)
            if at_rest:
                body[e, b, 3] = body[e, b, 4] = body[e, b, 5] = 0.0
            bodies.boxes[e, b, 0], bodies.boxes[e, b, 1] = body[e, b, 0], body[e, b, 1]
            bodies.boxes[e, b, 4] = math.cos(body[e, b, 2])
            bodies.boxes[e, b, 5] = math.sin(body[e, b, 2])
        elif owner >= 0:
            for k in range(6):
                bodies.body[e, owner, k] = rows[e, row, k]


@small_kernel
def count_contacts(bodies, solver, e, n_met):
    """Add new contacts to the counts of the cars.

    All contacts of a fresh space are new to it; those that lasted until shortly before are not
    counted again. Objects other than cars share one entry, so a car that touches several of them
    in the first step of a fresh space counts at most one.
    """
    n_cars, tick, fresh = bodies.contacts.shape[1], bodies.tick[e], solver.calls[e].fresh
    for k in range(n_met):
        first = find_car(solver, e, n_cars, solver.met[e, k, 0])
        second = find_car(solver, e, n_cars, solver.met[e, k, 1])
        for n, other in ((first, second), (second, first)):
            if n < n_cars:
                known = fresh and tick - bodies.touched[e, n, other] <= LASTS
                if solver.met[e, k, 2] != 0 and not known:
                    bodies.contacts[e, n] += 1.0
                bodies.touched[e, n, other] = tick


@small_kernel
def find_car(solver, e, n_cars, number):
    """Return the index of the car with a body ID of the solver; `n_cars` for other bodies."""
    for n in range(n_cars):
        if solver.car_ids[e, n] != 0 and solver.car_ids[e, n] == number:
            return n
    return n_cars
