"""Compiled search for the first event of a piece: a yield, the release of a slide that a rigid element holds, or a
turning point of a slide or of the output.

Up to the first turning point of a slide, whose speed is proved free of roots before it, the slide is monotone, so a
yield before it is one root of a monotone function: no event can be missed.
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .memory_kernels import holds, threshold
from .series_kernels import EPS, NONE, OVER, first_root, polish

# what ends a piece
NOTHING = 0
YIELDS = 1
TURNS = 2
OUTPUT_TURNS = 3
STOPS = 4
RELEASES = 5
TINY = 1e-14  # of the terms of a speed: below it a slide at a turning point has no acceleration


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def heading(poly, top, rests):
    """(order of the first term of a speed that counts, its sign); poly: its series; rests: it is zero at first."""
    if not rests and poly[0] != 0.0:
        return 0, 1.0 if poly[0] > 0 else -1.0
    size = 0.0
    for k in range(top):
        size += abs(poly[k])
    for k in range(1, min(top, 4)):
        if abs(poly[k]) > TINY * size:
            return k, 1.0 if poly[k] > 0 else -1.0
    return 0, 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def speed_series(row, count, coefs, top, poly):
    """Fill poly (top,) with the series of the rate over u of row (n,) times the coordinates, `count` of them."""
    for k in range(top):
        part = 0.0
        for i in range(count):
            part += row[i] * coefs[k + 1, i]
        poly[k] = (k + 1) * part


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def moved(poly, top, u):
    """Integral from 0 to u of a speed whose series is poly (top,)."""
    out = poly[top - 1] * OVER[top]
    for k in range(top - 2, -1, -1):
        out = out * u + poly[k] * OVER[k + 1]
    return out * u


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def crossing(poly, top, distance, limit, scratch):
    """Return u in (0, limit] at which a slide with the speed series `poly` has moved by `distance`; NONE if never.

    The slide is monotone up to the limit. distance: signed [m]; scratch: workspace for a polynomial.
    """
    end = moved(poly, top, limit)
    way = 1.0 if distance > 0 else -1.0
    if way * end < way * distance:
        return NONE
    scratch[0] = way * distance
    for k in range(top):
        scratch[k + 1] = -way * poly[k] * OVER[k + 1]
    start = limit * distance / end
    square = scratch[1] * scratch[1] - 4 * scratch[0] * scratch[2]
    # the root of the first three terms
    if square > 0 and 2 * scratch[0] < limit * (sqrt(square) - scratch[1]):
        start = 2 * scratch[0] / (sqrt(square) - scratch[1])
    return polish(scratch, 0, top, 0.0, limit, start)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def released(face, top, limit, workspace):
    """(u, side) at which the reaction of a slide that is held first passes its limit [N], +1 or -1; NONE for u if it
    does not."""
    react = workspace.reactions[face]
    scratch = workspace.polys[workspace.react.shape[0]]
    size = limit
    for k in range(top - 1):
        size += abs(react[k])
    best = NONE
    to = 0.0
    if size < 2 * limit and workspace.orders[face, 0] == 0.0 and workspace.orders[face, 1] == 0.0:
        return best, to
    for side in (1, -1):
        order = int(workspace.orders[face, (1 - side) // 2])
        for k in range(order, top - 1):
            scratch[k] = -side * react[k]
        if order == 0:
            scratch[0] += limit
            if scratch[0] <= 4 * EPS * size:
                scratch[0] = max(scratch[0], 0.0)
        root = first_root(scratch, order, top - 2, workspace.hulls) if order < top - 1 else NONE
        if root < best:
            best = root
            to = float(side)
    return best, to


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rest(face, head, poly, top, workspace):
    """u at which the slip of a rigid element first rests; NONE if it does not. poly: series of its speed."""
    scratch = workspace.polys[workspace.react.shape[0]]
    order = int(workspace.orders[face, 0])
    if order == 0 and head * poly[0] <= 0.0:
        return 0.0
    for k in range(order, top):
        scratch[k] = head * poly[k]
    return first_root(scratch, order, top - 1, workspace.hulls) if order < top else NONE


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def next_event(top, modal_system, table, memory, time_state, workspace):
    """(u, what, face, sign) of the first event of a piece; u = 1 and NOTHING where none ends it.

    u = 0: the state changes before anything moves.
    """
    faces = len(modal_system.reach)
    polys = workspace.polys
    u = 1.0
    what = NOTHING
    face = 0
    sign = 0.0
    for f in range(faces):
        poly = polys[f]
        speed_series(modal_system.faces[f], len(modal_system.square), workspace.coefs, top, poly)
        if holds(f, table, memory):
            root, way = released(f, top, table.static[f], workspace)
            if root <= u:
                u = root
                what = RELEASES
                face = f
                sign = way
            continue
        if table.static[f] > 0.0:
            way = memory.head[f]
            if abs(way) == 2.0:
                continue
            root = rest(f, way, poly, top, workspace)
            if root <= u:
                u = root
                what = TURNS
                face = f
                sign = -way
            if table.count[f] == 0 or u == 0.0:
                continue
        else:
            order, way = heading(poly, top, time_state.rest[f] == 1.0)
            if way == 0.0:
                continue
            if memory.slipping[f] > 0 and way != memory.way[f]:
                return 0.0, TURNS, f, way
            scratch = polys[faces]
            for k in range(order, top):
                scratch[k] = way * poly[k]
            root = first_root(scratch, order, top - 1, workspace.hulls)
            if root < u:
                u = root
                what = TURNS
                face = f
                sign = -way
        gap = threshold(f, way, table, memory) - memory.place[f]
        if way * gap <= 0:
            return 0.0, YIELDS, f, way
        root = crossing(poly, top, gap, u, polys[faces])
        if root <= u:
            u = root
            what = YIELDS
            face = f
            sign = way
    if modal_system.along < 0:
        poly = polys[faces + 1]
        scratch = polys[faces]
        speed_series(modal_system.output, len(modal_system.square), workspace.coefs, top, poly)
        order, way = heading(poly, top, time_state.rest[faces] == 1.0)
        for k in range(order, top):
            scratch[k] = way * poly[k]
        root = first_root(scratch, order, top - 1, workspace.hulls) if way != 0.0 else NONE
        if root < u:
            u = root
            what = OUTPUT_TURNS
            face = faces
            sign = -way
    return u, what, face, sign
