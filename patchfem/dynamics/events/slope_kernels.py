"""Compiled run from event to event that carries its derivative along.

What an interface remembers is where its slide turned. The force is continuous in those places and in the slide, so at a
yield or a turning point nothing jumps, and the derivative over a run is the product of the linear flows of its pieces
alone. A turning point may shift in time, but the slide is at rest there, so the derivative of the new turning place is
that of the slide.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .drive_kernels import drive_series, rate_of
from .march_kernels import (
    AT_ONCE,
    MOST_IDLE,
    advance,
    arrive,
    happen,
    left_of,
    output_of,
    wait,
    widen,
)
from .memory_kernels import pulled, tangent
from .search_kernels import TURNS, next_event
from .series_kernels import REACH, fastest, motion_series, powers


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def carry(u, h, top, slopes, marks, modal_system, table, memory, workspace, scratch):
    """Move slopes (2, n, s) of coordinates and rates over a piece up to u; marks (i, t + 2, s): those of the turning
    places.

    scratch: the slopes of one number (2, n), the force on them (i,), their series (terms, n).
    """
    one, force, coefs = scratch
    n = len(modal_system.square)
    faces = len(modal_system.reach)
    zero = workspace.waves[1]
    for s in range(slopes.shape[2]):
        for i in range(n):
            one[0, i] = slopes[0, i, s]
            one[1, i] = slopes[1, i, s]
        for f in range(faces):
            first = memory.slipping[f]
            moved = 0.0
            for i in range(n):
                moved += modal_system.faces[f, i] * one[0, i]
            force[f] = workspace.springs[f] * moved
            for k in range(memory.depth[f] - 1, -1, -1):
                end = memory.upto[f, k]
                force[f] -= (table.stiff[f, end] - table.stiff[f, first]) * marks[f, k, s]
                first = end
        motion_series(
            one[0], one[1], force, workspace.springs, modal_system, zero, h, top, coefs, workspace
        )
        for i in range(n):
            place = coefs[top, i]
            rate = top * coefs[top, i]
            for k in range(top - 1, 0, -1):
                place = place * u + coefs[k, i]
                rate = rate * u + k * coefs[k, i]
            slopes[0, i, s] = coefs[0, i] + u * place
            slopes[1, i, s] = rate / h


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def follow(
    stop,
    motion,
    slopes,
    marks,
    modal_system,
    table,
    memory,
    time_state,
    books,
    workspace,
    scratch,
    seen,
):
    """`march_kernels.march` without rows and energies, with the derivative: pieces, -1 where events pile up.

    slopes (2, n, s) of the motion and marks (i, t + 2, s) of the memory's turning places, to s numbers, move along;
    scratch: room as `carry` has it; seen (2, i): most elements that slip, fewest groups that stay.
    """
    for f in range(len(modal_system.reach)):
        memory.force[f] = pulled(f, table, memory)
    now = time_state.now
    faces = len(modal_system.reach)
    n = len(modal_system.square)
    pieces = 0
    for k in range(workspace.waves.shape[1]):
        workspace.waves[1, k] = 0.0
    while now[0] < stop[0] or (now[0] == stop[0] and now[1] < stop[1]):
        left = left_of(time_state, stop)
        segment = time_state.segments[int(now[2])]
        for f in range(faces):
            workspace.springs[f] = tangent(f, table, memory)[0]
            seen[0, f] = max(seen[0, f], memory.slipping[f])
            seen[1, f] = min(seen[1, f], memory.depth[f])
        rate = max(fastest(modal_system, workspace.springs), rate_of(segment, time_state.period[0]))
        h = min(
            REACH / rate * min(1.0, max(rate * wait(motion, modal_system, table, memory), 0.02)),
            left,
        )
        whole = h == left
        top = powers(rate * h)
        drive_series(segment, now[0], now[1], time_state.period[0], h, top, workspace.waves)
        motion_series(
            motion[0],
            motion[1],
            memory.force,
            workspace.springs,
            modal_system,
            workspace.waves[0],
            h,
            top,
            workspace.coefs,
            workspace,
        )
        u, what, face, sign = next_event(top, modal_system, table, memory, time_state, workspace)
        if u > 0:
            if now[1] == 0.0:
                widen(output_of(motion, modal_system), time_state, books)
            carry(u, h, top, slopes, marks, modal_system, table, memory, workspace, scratch)
            if u > AT_ONCE:
                for f in range(faces + 1):
                    time_state.rest[f] = 0.0
            advance(u, h, top, motion, modal_system, table, memory, time_state, books, workspace)
            if whole and (u == 1.0 or now[1] + u * h >= now[1] + left):
                arrive(time_state, stop, left)
            else:
                now[1] += u * h
            pieces += 1
        books.limits[1] = books.limits[1] + 1 if u * h < 1e-13 * time_state.period[0] else 0.0
        if books.limits[1] > MOST_IDLE:
            return -1
        if what == TURNS and memory.slipping[face] > 0:
            for s in range(slopes.shape[2]):
                moved = 0.0
                for i in range(n):
                    moved += modal_system.faces[face, i] * slopes[0, i, s]
                marks[face, memory.depth[face], s] = moved
        happen(what, face, sign, modal_system, table, memory, time_state)
    for f in range(faces):
        seen[0, f] = max(seen[0, f], memory.slipping[f])
        seen[1, f] = min(seen[1, f], memory.depth[f])
    return pieces
