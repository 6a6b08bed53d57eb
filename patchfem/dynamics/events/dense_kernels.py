"""Compiled reading of a run's rows: the motion at any time in a piece, and the largest absolute acceleration."""

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .drive_kernels import RATE, drive_series, rate_of
from .march_kernels import EACH, HEAD
from .memory_kernels import RIGID
from .search_kernels import moved, speed_series
from .series_kernels import REACH, fastest, largest, motion_series, powers, value
from .slow_kernels import at_reach, shortened
from .stick_kernels import constrain


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def unfold(row, h, modal_system, time_state, workspace):
    """Fill the workspace with the series of the piece of a row over h [s]; the highest power.

    What holds is found again where it is not what workspace.mask has; workspace.held[0] < 0 before the first row.
    """
    n = len(modal_system.square)
    faces = len(modal_system.reach)
    segment = time_state.segments[int(row[3])]
    start = HEAD + 2 * n
    place = row[HEAD : HEAD + n]
    speed = row[HEAD + n : start]
    for f in range(faces):
        workspace.polys[faces, f] = row[start + EACH * f]
        workspace.springs[f] = row[start + EACH * f + 1]
        holds = 1.0 if workspace.springs[f] == RIGID else 0.0
        if workspace.mask[f] != holds:
            workspace.mask[f] = holds
            workspace.held[0] = -1.0
    if workspace.held[0] < 0.0:
        constrain(modal_system, workspace)
    own = fastest(modal_system, workspace.springs) if workspace.held[1] == 0.0 else 0.0
    rate = rate_of(segment, time_state.period[0])
    if own * h > REACH * (1 + 1e-9):
        at_reach(
            segment,
            row[5],
            row[6],
            time_state.period[0],
            place,
            speed,
            workspace.polys[faces],
            modal_system,
            workspace,
        )
        top = powers(rate * h)
        shortened(rate * h / REACH, top, faces, workspace)
    else:
        top = powers(max(own, segment[RATE]) * h)
        drive_series(segment, row[5], row[6], time_state.period[0], h, top, workspace.waves)
        motion_series(
            place,
            speed,
            workspace.polys[faces],
            workspace.springs,
            modal_system,
            workspace.waves[0],
            h,
            top,
            workspace.coefs,
            workspace,
        )
    for f in range(faces):
        speed_series(
            modal_system.faces[f],
            len(modal_system.square),
            workspace.coefs,
            top,
            workspace.polys[f],
        )
    return top


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def evaluate(rows, owner, tau, modal_system, time_state, workspace, out):
    """Motion at tau (j,) [s] after the starts of the rows owner (j,), rising.

    out (j, 2 n + 1 + 6 i): z, v, drive [m s-2], then of every interface slide [m], rate [m/s], force [N], slip [m],
    work and loss [J].
    """
    n = len(modal_system.square)
    faces = len(modal_system.reach)
    last = -1
    top = 0
    h = 1.0
    workspace.held[0] = -1.0
    for j in range(owner.size):
        row = rows[owner[j]]
        if owner[j] != last:
            last = owner[j]
            h = max(row[1], 1e-300)
            top = unfold(row, h, modal_system, time_state, workspace)
        u = tau[j] / h
        for i in range(n):
            out[j, i] = value(workspace.coefs[:, i], 0, top, u)
            rate = top * workspace.coefs[top, i]
            for k in range(top - 1, 0, -1):
                rate = rate * u + k * workspace.coefs[k, i]
            out[j, n + i] = rate / h
        out[j, 2 * n] = value(workspace.waves[0], 0, top, u)
        for f in range(faces):
            at = HEAD + 2 * n + EACH * f
            to = 2 * n + 1 + 6 * f
            if workspace.springs[f] == RIGID:
                out[j, to] = row[at + 8]
                out[j, to + 1] = 0.0
                out[j, to + 2] = value(workspace.reactions[f], 0, top - 2, u)
                out[j, to + 3] = row[at + 4]
                out[j, to + 4] = row[at + 5]
                out[j, to + 5] = row[at + 6]
                continue
            step = moved(workspace.polys[f], top, u)
            place = 0.0
            for i in range(n):
                place += modal_system.faces[f, i] * out[j, i]
            out[j, to] = place
            out[j, to + 1] = value(workspace.polys[f], 0, top - 1, u) / h
            out[j, to + 2] = row[at] + row[at + 1] * step
            out[j, to + 3] = row[at + 4] + row[at + 2] * step
            out[j, to + 4] = row[at + 5] + (row[at] + 0.5 * row[at + 1] * step) * step
            out[j, to + 5] = row[at + 6] + row[at + 3] * abs(step)


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def peak(rows, modal_system, time_state, moving, workspace, reactions):
    """Largest |acceleration| [m s-2] of the output over the pieces of rows, that of a moving base included; reactions
    (i,) [N] becomes the largest of every interface while a rigid element holds it."""
    best = 0.0
    poly = workspace.polys[len(modal_system.reach)]
    faces = len(modal_system.reach)
    workspace.held[0] = -1.0
    for f in range(faces):
        reactions[f] = 0.0
    for j in range(rows.shape[0]):
        h = rows[j, 1]
        if h <= 0:
            continue
        top = unfold(rows[j], h, modal_system, time_state, workspace)
        for k in range(top - 1):
            part = 0.0
            for i in range(len(modal_system.square)):
                part += modal_system.output[i] * workspace.coefs[k + 2, i]
            poly[k] = part * (k + 1) * (k + 2) / (h * h) + moving * workspace.waves[0, k]
        best = largest(poly, top - 2, best, workspace.hulls)
        for f in range(faces):
            if workspace.springs[f] == RIGID:
                reactions[f] = largest(
                    workspace.reactions[f], top - 2, reactions[f], workspace.hulls
                )
    return best
