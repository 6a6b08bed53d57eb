"""Compiled choice of the interfaces that hold after an event: Coulomb friction at several interfaces at once.

Slides that are held give z'' = P a, with a the acceleration without their friction and P the projector on the motions
that leave them alone; their reactions are what the projection takes. Dependent ones (1-0, 2-0 and 1-2) share it by
least squares: the motion is unique, the split between them is not, and one that this split would overload while the
others hold it carries its limit and leaves the rest to them. A choice holds when every held slide is below its limit,
or at it and going back, and every other one starts to move its own way, told by the first term that is not zero.
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .memory_kernels import RIGID, holds, pulled, tangent
from .series_kernels import EPS, TWICE, motion_series

NOISE = 64 * EPS
LOOSER = 1e4  # times that for sets of badly conditioned slides
LAST = 8  # order of the terms that are looked at
# slides at rest up to which all choices are tried without an exchange: 81 at most
MAX_ENUMERATED_FIRST = 4
MAX_ENUMERATED = 8  # slides at rest up to which all choices are tried where the exchange finds none: 6561 at most
EXCHANGES = 8  # exchanges for each slide, after which a choice by exchange is given up


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def turned_rows(modal_system, workspace):
    """Turn the rows of the masked slides until they are orthogonal (one-sided Jacobi), workspace.turned = mix slide; the
    length of the longest."""
    n = len(modal_system.square)
    faces = len(modal_system.reach)
    for f in range(faces):
        for i in range(n):
            workspace.turned[f, i] = modal_system.faces[f, i] if workspace.mask[f] == 1.0 else 0.0
        for g in range(faces):
            workspace.mix[f, g] = 1.0 if f == g else 0.0
    for _ in range(40 if workspace.held[0] > 1.0 else 0):
        quiet = True
        for f in range(faces):
            for g in range(f + 1, faces):
                a = 0.0
                b = 0.0
                c = 0.0
                for i in range(n):
                    a += workspace.turned[f, i] ** 2
                    b += workspace.turned[g, i] ** 2
                    c += workspace.turned[f, i] * workspace.turned[g, i]
                if abs(c) <= EPS * sqrt(a * b):
                    continue
                quiet = False
                steep = (b - a) / (2 * c)
                slope = (1.0 if steep >= 0 else -1.0) / (abs(steep) + sqrt(1 + steep * steep))
                cosine = 1 / sqrt(1 + slope * slope)
                for i in range(n):
                    p = workspace.turned[f, i]
                    q = workspace.turned[g, i]
                    workspace.turned[f, i] = cosine * (p - slope * q)
                    workspace.turned[g, i] = cosine * (slope * p + q)
                for h in range(faces):
                    p = workspace.mix[f, h]
                    q = workspace.mix[g, h]
                    workspace.mix[f, h] = cosine * (p - slope * q)
                    workspace.mix[g, h] = cosine * (slope * p + q)
        if quiet:
            break
    most = 0.0
    for f in range(faces):
        size = 0.0
        for i in range(n):
            size += workspace.turned[f, i] ** 2
        most = max(most, size)
    return sqrt(most)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def constrain(modal_system, workspace):
    """Hold the slides of workspace.mask (i,).

    Fills turned (i, n), orthogonal rows that span theirs (0 in those too many), react (i, n), the pseudo-inverse of
    their rows turned over (0 in those of the others), tied (i,) 1 where they hold a slide, and held: (how many there
    are, whether nothing can move).
    """
    n = len(modal_system.square)
    faces = len(modal_system.reach)
    count = 0.0
    for f in range(faces):
        count += workspace.mask[f]
        workspace.tied[f] = 0.0
        for i in range(n):
            workspace.react[f, i] = 0.0
    workspace.held[0] = count
    workspace.held[1] = 0.0
    if count == 0.0:
        return
    most = turned_rows(modal_system, workspace)
    for p in range(faces):
        size = 0.0
        for i in range(n):
            size += workspace.turned[p, i] ** 2
        if sqrt(size) <= 1e-10 * most:
            for i in range(n):
                workspace.turned[p, i] = 0.0
            continue
        for q in range(faces):
            if workspace.mask[q] == 1.0:
                for i in range(n):
                    workspace.react[q, i] += workspace.mix[p, q] * workspace.turned[p, i] / size
    frees = 0.0 if count >= n else 1.0
    if count >= n:
        for i in range(n):
            for j in range(n):
                part = 1.0 if i == j else 0.0
                for f in range(faces):
                    part -= workspace.react[f, i] * modal_system.faces[f, j]
                frees = max(frees, abs(part))
    if frees < 1e-9:
        workspace.held[1] = 1.0
    for f in range(faces):
        left = 0.0
        size = 0.0
        for j in range(n):
            part = modal_system.faces[f, j]
            for g in range(faces):
                along = 0.0
                for i in range(n):
                    along += modal_system.faces[f, i] * workspace.react[g, i]
                part -= along * modal_system.faces[g, j]
            left += part * part
            size += modal_system.faces[f, j] ** 2
        if workspace.held[1] == 1.0 or left < 1e-18 * size:
            workspace.tied[f] = 1.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def remove_held_slides(rates, modal_system, workspace):
    """Take from rates (n,) what moves the slides that are held."""
    n = len(modal_system.square)
    if workspace.held[1] == 1.0:
        for i in range(n):
            rates[i] = 0.0
        return
    for f in range(len(modal_system.reach)):
        workspace.row[0, f] = 0.0
        for i in range(n):
            workspace.row[0, f] += modal_system.faces[f, i] * rates[i]
    for f in range(len(modal_system.reach)):
        for i in range(n):
            rates[i] -= workspace.react[f, i] * workspace.row[0, f]


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def keep(motion, modal_system, memory, workspace):
    """Take the round-off of slides that are held out of coordinates and rates."""
    if workspace.held[0] == 0.0 or workspace.held[1] == 1.0:
        return
    n = len(modal_system.square)
    remove_held_slides(motion[1], modal_system, workspace)
    for f in range(len(modal_system.reach)):
        workspace.row[0, f] = memory.place[f]
        for i in range(n):
            workspace.row[0, f] -= modal_system.faces[f, i] * motion[0, i]
    for f in range(len(modal_system.reach)):
        for i in range(n):
            motion[0, i] += workspace.react[f, i] * workspace.row[0, f]


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def round_off(motion, force, springs, modal_system, h, workspace):
    """Fill scales (LAST + 2, n) with the magnitudes that the terms of a motion are added from, spans (i, LAST) with
    those of the reactions [N]; arguments as of `motion_series`."""
    n = len(modal_system.square)
    faces = modal_system.faces
    squared = h * h
    wave = workspace.waves[0]
    for i in range(n):
        workspace.scales[0, i] = abs(motion[0, i])
        workspace.scales[1, i] = abs(h * motion[1, i])
    for k in range(LAST):
        scale = TWICE[k + 2] * squared
        damp = TWICE[k + 2] * h * (k + 1)
        for f in range(len(modal_system.reach)):
            workspace.pull[f] = 0.0
            if springs[f] < RIGID and k == 0:
                workspace.pull[f] = abs(force[f]) / modal_system.mass
            elif springs[f] < RIGID:
                for i in range(n):
                    workspace.pull[f] += (
                        abs(faces[f, i]) * workspace.scales[k, i] * springs[f] / modal_system.mass
                    )
        for i in range(n):
            part = modal_system.square[i] * workspace.scales[k, i] + abs(
                modal_system.base[i] * wave[k]
            )
            lost = 0.0
            for f in range(len(modal_system.reach)):
                part += abs(faces[f, i]) * workspace.pull[f]
            for j in range(n):
                lost += abs(modal_system.damping[i, j]) * workspace.scales[k + 1, j]
            workspace.scales[k + 2, i] = scale * part + damp * lost
        if workspace.held[0] == 0.0:
            continue
        for f in range(len(modal_system.reach)):
            workspace.spans[f, k] = 0.0
            for i in range(n):
                workspace.spans[f, k] += abs(workspace.react[f, i]) * workspace.scales[k + 2, i]
        for f in range(len(modal_system.reach)):
            for i in range(n):
                workspace.scales[k + 2, i] += abs(faces[f, i]) * workspace.spans[f, k]
            workspace.spans[f, k] *= modal_system.mass / scale


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def leaves(face, sign, noise, modal_system, workspace):
    """(order, sign) of the first term of sign * speed of a slide that is above its round-off; (LAST, 0) without."""
    for k in range(1, LAST):
        rate = 0.0
        size = 0.0
        for i in range(len(modal_system.square)):
            rate += modal_system.faces[face, i] * workspace.coefs[k + 1, i]
            size += abs(modal_system.faces[face, i]) * workspace.scales[k + 1, i]
        if abs(rate) > noise * size:
            return float(k), 1.0 if sign * rate > 0 else -1.0
    return float(LAST), 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def margin(face, side, noise, limit, workspace):
    """(order, sign) of the first term of limit - side * reaction of a slide that is above its round-off; (LAST, 0)
    without."""
    for k in range(LAST):
        left = -side * workspace.reactions[face, k]
        size = workspace.spans[face, k]
        if k == 0:
            left = left + limit
            size = size + limit
        if abs(left) > noise * size:
            return float(k), 1.0 if left > 0 else -1.0
    return float(LAST), 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def judge(noise, motion, modal_system, table, memory, h, workspace):
    """(slide, side) of the first one for which the signs of slip in workspace.guess (i,), 0 of slides that hold, break the
    law just after an event, those of workspace.resting having no speed: overloaded on a side, 1 or -1, or 0 where it does
    not go the way of its slip; (-1, 0) where all obey.

    memory.head, force, springs and what holds are left as they are under the guess, orders as the search for the next
    event takes them.
    """
    faces = len(modal_system.reach)
    for f in range(faces):
        workspace.mask[f] = 1.0 if table.static[f] > 0.0 and workspace.guess[f] == 0.0 else 0.0
    constrain(modal_system, workspace)
    for f in range(faces):
        if table.static[f] > 0.0:
            others = (
                workspace.guess[f] != 0.0
                and workspace.tied[f] == 1.0
                and workspace.resting[f] == 1.0
            )
            memory.head[f] = 2.0 * workspace.guess[f] if others else workspace.guess[f]
        memory.force[f] = pulled(f, table, memory)
        workspace.springs[f] = tangent(f, table, memory)[0]
        workspace.orders[f, 0] = 0.0
        workspace.orders[f, 1] = 0.0
    motion_series(
        motion[0],
        motion[1],
        memory.force,
        workspace.springs,
        modal_system,
        workspace.waves[0],
        h,
        LAST + 1,
        workspace.coefs,
        workspace,
    )
    round_off(motion, memory.force, workspace.springs, modal_system, h, workspace)
    for f in range(faces):
        if workspace.resting[f] == 0.0 or table.static[f] == 0.0 or abs(memory.head[f]) == 2.0:
            continue
        if memory.head[f] != 0.0:
            order, lead = leaves(f, memory.head[f], noise, modal_system, workspace)
            if lead <= 0.0:
                return f, 0
            workspace.orders[f, 0] = order
            continue
        for side in (1, -1):
            order, lead = margin(f, side, noise, table.static[f], workspace)
            if lead < 0.0:
                return f, side
            if lead > 0.0:
                workspace.orders[f, (1 - side) // 2] = order
    return -1, 0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def exchanged(noise, motion, modal_system, table, memory, h, workspace):
    """Exchange the first slide that breaks the law, from workspace.guess (i,) on; whether a choice is found.

    This is the rule of least index (Murty, Opsearch 11, 148, 1974). It ends with the only solution wherever the
    complementarity problem has a P-matrix, also over power series in time, which are ordered by their first term; that
    is the case for slides that are independent and break at their kinetic limit. Of 1800 random choices among 5 to 16
    slides at rest it and `every` together missed 26, all of more than eight slides of fewer modes.
    """
    for _ in range(EXCHANGES * len(modal_system.reach)):
        slide, side = judge(noise, motion, modal_system, table, memory, h, workspace)
        if slide < 0:
            return True
        workspace.guess[slide] = float(side)
    return False


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def every(noise, motion, modal_system, table, memory, h, workspace):
    """Whether one of all choices of the slides at rest holds, those with few that slip first."""
    faces = len(modal_system.reach)
    count = 0
    codes = 1
    for f in range(faces):
        if workspace.resting[f] == 1.0:
            count = count + 1
            codes = codes * 3
    for slips in range(count + 1):
        for code in range(codes):
            left = code
            found = 0
            for f in range(faces - 1, -1, -1):
                workspace.guess[f] = workspace.signs[f]
                if workspace.resting[f] == 1.0:
                    digit = left % 3
                    workspace.guess[f] = -1.0 if digit == 2 else float(digit)
                    left = left // 3
                    found = found + (digit > 0)
            if (
                found == slips
                and judge(noise, motion, modal_system, table, memory, h, workspace)[0] < 0
            ):
                return True
    return False


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def settle(motion, modal_system, table, memory, h, workspace):
    """Choose which rigid elements hold just after an event, and which way the others slip; whether a choice was found.

    The first guess is judged, then slides are exchanged, then all choices of a few slides are tried.
    workspace.signs (i,): the first guess; of slides outside of workspace.resting (i,) their slip.
    workspace.waves[0]: series of the drive over h [s]. Rates of the resting slides are taken out of
    the motion.
    """
    faces = len(modal_system.reach)
    count = 0
    for f in range(faces):
        workspace.mask[f] = workspace.resting[f]
    constrain(modal_system, workspace)
    if workspace.held[0] > 0.0:
        remove_held_slides(motion[1], modal_system, workspace)
    for f in range(faces):
        if table.static[f] > 0.0 and workspace.tied[f] == 1.0:
            workspace.resting[f] = 1.0
        count += int(workspace.resting[f])
    for noise in (NOISE, LOOSER * NOISE):
        for f in range(faces):
            workspace.guess[f] = workspace.signs[f]
        if judge(noise, motion, modal_system, table, memory, h, workspace)[0] < 0:
            return True
        if count > MAX_ENUMERATED_FIRST and exchanged(
            noise, motion, modal_system, table, memory, h, workspace
        ):
            return True
        if count <= MAX_ENUMERATED and every(
            noise, motion, modal_system, table, memory, h, workspace
        ):
            return True
    return False


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def at_rest(u, h, top, modal_system, table, memory, workspace):
    """Note in workspace.resting (i,) which slides of rigid elements have no speed at u of a piece: those held, and those
    whose speed is round-off; workspace.signs are those of their slip."""
    for f in range(len(modal_system.reach)):
        head = memory.head[f]
        workspace.signs[f] = 0.0 if head == 0.0 else 1.0 if head > 0 else -1.0
        workspace.resting[f] = 1.0 if table.static[f] > 0.0 else 0.0
        if holds(f, table, memory) or table.static[f] == 0.0 or abs(head) == 2.0:
            continue
        speed = 0.0
        size = 0.0
        power = 1.0
        for k in range(1, top + 1):
            for i in range(len(modal_system.square)):
                part = modal_system.faces[f, i] * workspace.coefs[k, i] * (k * power)
                speed += part
                size += abs(part)
            power *= u
        if workspace.signs[f] * speed > NOISE * size:
            workspace.resting[f] = 0.0
