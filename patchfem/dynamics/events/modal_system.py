"""Arrays of the compiled loop: modes, drive, room and books."""

from typing import NamedTuple

import numpy as np

from ...compiled import kernels
from ...core import ModalBasis, PatchfemError
from .elements import Memory, Table, virgin

SLOW = 0.02  # of the slowest rate of the modes
kinds = kernels("dynamics.events.drive_kernels")
series = kernels("dynamics.events.series_kernels")


class ModalSystem(NamedTuple):
    """Modes as the loop takes them.

    The loop asks `square` how many modes there are and `reach` how many interfaces. Of one mode behind one interface
    both are tuples: their length is then part of their type, so that the same text is compiled for one of each, three
    times as fast.

    square: (n,) omega^2 [1/s2]; damping: (n, n) D [1/s], coupled: whether it is more than its diagonal; base, output:
    (n,); faces: (i, n); mass [kg]; reach: (i,) |face|^2/mass [1/kg], how much a spring there adds to a square of a
    rate; square_most, damping_most: norms of the modes' own; along: number of an interface that
    moves as the output does, -1 where none does; slow: rate [1/s] of a drive up to which the modes, once they do not
    ring, follow it in a series of its own (`slow_kernels`), 0 where one has no stiffness or no damper.
    """

    square: np.ndarray
    damping: np.ndarray
    base: np.ndarray
    faces: np.ndarray
    output: np.ndarray
    reach: np.ndarray
    mass: float
    square_most: float
    damping_most: float
    coupled: int
    along: int
    slow: float


def plant_of(modes: ModalBasis) -> ModalSystem:
    """The Plant of a basis."""
    damping = np.array(modes.damping_matrix, float)
    faces = np.array(modes.interfaces, float)
    output = np.array(modes.output, float)
    along = next(
        (
            k
            for k, face in enumerate(faces)
            if len(face) == 1 or not np.any(np.outer(face, output) - np.outer(output, face))
        ),
        -1,
    )
    coupled = len(damping) > 1 and bool(np.any(damping != np.diag(np.diag(damping))))
    most = np.linalg.norm(damping, 2) if coupled else np.abs(damping).max()
    square = np.array(modes.omega, float) ** 2
    reach = (faces**2).sum(axis=1) / modes.mass
    least = float(square.min())
    slow = SLOW * min(np.sqrt(least), least / max(most, 1e-300)) if np.diag(damping).all() else 0.0
    if faces.shape == (1, 1):
        square = tuple(square.tolist())
        reach = tuple(reach.tolist())
    return ModalSystem(
        square,
        np.ascontiguousarray(damping),
        np.array(modes.base, float),
        np.ascontiguousarray(faces),
        output,
        reach,
        float(modes.mass),
        float(modes.omega.max() ** 2),
        float(most),
        int(coupled),
        along,
        float(slow),
    )


class Clock(NamedTuple):
    """Time of a run: now (6,) cycle, offset in it [s], segment of the drive, what begins the next row, pieces since the
    last event, and 1 where the loop stopped for want of rows; segments (p, 12) rows of `drive_kernels`; period (1,)
    [s]; rest (i + 1,) 1 where a slide, or last the output, stands still at a turning point."""

    now: np.ndarray
    segments: np.ndarray
    period: np.ndarray
    rest: np.ndarray


def clock_of(drive, faces: int) -> Clock:
    """The Clock of a drive of `core` or `structure.drives` at t = 0. PatchfemError where it begins later."""
    segments = segments_of(drive)
    if segments[0, :2].any():
        raise PatchfemError("drive: the first segment of the drive must start at 0 s")
    return Clock(np.zeros(6), segments, np.array([drive.period]), np.zeros(faces + 1))


def segments_of(drive) -> np.ndarray:
    """The segments of a drive of `core` or `structure.drives` as rows (p, 12) of `drive_kernels`."""
    period = drive.period
    if drive.segments:
        rows = [_sine(part, period) for part in drive.segments]
    else:
        rows = (_swept if hasattr(drive, "low") else _lines)(drive)
    out = np.zeros((len(rows), 12))
    for row, (start, *numbers) in zip(out, rows):
        row[:2] = place(start, period)
        row[2 : 2 + len(numbers)] = numbers
    return out


def place(time: float, period: float) -> tuple:
    """(cycle, offset [s]) of a time [s]; within a last digit of a whole cycle it is that one."""
    share = time / period
    near = round(share)
    if abs(share - near) <= 4e-15 * max(1.0, abs(share)):
        return float(near), 0.0
    return float(int(share)), max(time - int(share) * period, 0.0)


def _sine(part, period: float) -> tuple:
    omega = part.omega if part.amplitude else 0.0
    turns = omega * period / (2 * np.pi)
    more = 0.0 if abs(turns - round(turns)) < 4e-15 * max(1.0, turns) else turns - int(turns)
    coarse = round(more * 2**24) / 2**24
    steady = part.constant + (0.0 if omega else part.amplitude * np.sin(part.phase))
    phase = part.phase - omega * place(part.start, period)[1]
    return (
        part.start,
        kinds.SINE,
        steady,
        part.amplitude if omega else 0.0,
        omega,
        phase,
        0.0,
        0.0,
        omega,
        coarse,
        more - coarse,
    )


def _swept(sweep) -> list:
    """The sweep, then the sine at its last frequency."""
    low = 2 * np.pi * sweep.low
    high = 2 * np.pi * sweep.high
    span = sweep.duration
    log = sweep.logarithmic and high != low
    slope = np.log(high / low) / span if log else (high - low) / span
    moved = sweep.displacement is not None
    size = sweep.displacement if moved else sweep.acceleration
    last = float(sweep.phase(span)) - high * place(span, sweep.period)[1]
    return [
        (
            0.0,
            kinds.LOG_CHIRP if log else kinds.CHIRP,
            0.0,
            size,
            low,
            0.0,
            slope,
            float(moved),
            sweep.rate,
        ),
        (span, kinds.SINE, 0.0, size * high**2 if moved else size, high, last, 0.0, 0.0, high),
    ]


def _lines(record) -> list:
    """Straight lines between the rows of a record, then nothing."""
    slopes = np.diff(record.value) / np.diff(record.time)
    rows = [
        (float(t), kinds.LINE, float(y), 0.0, 0.0, 0.0, float(s), 0.0, 0.0)
        for t, y, s in zip(record.time, record.value, slopes)
    ]
    return [*rows, (float(record.time[-1]), kinds.LINE, *[0.0] * 7)]


def into(old, new):
    """A tuple of arrays, or of such tuples, in the arrays of another: compiled code knows where these are, which takes
    most of the time of a short call. `new` itself where `old` is None or has other shapes."""
    if old is None or not _fits(old, new):
        return new
    for mine, given in zip(old, new):
        if isinstance(mine, tuple):
            into(mine, given)
        else:
            mine[...] = given
    return old


def _fits(old, new) -> bool:
    """Whether two tuples of arrays have the same shapes."""
    return all(
        _fits(mine, given) if isinstance(mine, tuple) else mine.shape == given.shape
        for mine, given in zip(old, new)
    )


class Past(NamedTuple):
    """State at the last border of a cycle, by which `repeat_kernels` knows a motion that repeats.

    about (3,): segment of the drive then, -1 before there is a state; cycle up to which states lay far apart; 1 where
    the motion repeats to the last bit. motion (2, n); memory: of the elements.
    """

    about: np.ndarray
    motion: np.ndarray
    memory: Memory


def past_of(modal_system: ModalSystem, table: Table) -> Past:
    """The Past of a run that begins."""
    return Past(
        np.array([-1.0, 0.0, 0.0]),
        np.zeros((2, len(modal_system.square))),
        virgin(table, np.zeros(len(modal_system.reach))),
    )


class Room(NamedTuple):
    """Room of the loop: coefs (terms, n), waves (3, terms) of the drive, polys (i + 3, terms), pull and springs (i,),
    nodes (n, 4) of the sums, hulls of the search for roots.

    Of slides that rigid elements hold (`stick_kernels`): mask (i,) which, held (2,) how many and whether nothing can
    move, react (i, n) and tied (i,) as `constrain` leaves them, reactions (i, terms) [N] over a piece; orders (i, 2) of
    the terms that vanish where a piece begins after an event, -1 before the first choice; resting, signs, guess (i,) of
    a choice, scales (terms, n) and spans (i, terms) of its round-off, turned (i, n), mix and gram (i, i), row (2, i).
    """

    coefs: np.ndarray
    waves: np.ndarray
    polys: np.ndarray
    pull: np.ndarray
    springs: np.ndarray
    nodes: np.ndarray
    hulls: np.ndarray
    mask: np.ndarray
    held: np.ndarray
    react: np.ndarray
    tied: np.ndarray
    reactions: np.ndarray
    orders: np.ndarray
    resting: np.ndarray
    signs: np.ndarray
    guess: np.ndarray
    scales: np.ndarray
    spans: np.ndarray
    turned: np.ndarray
    mix: np.ndarray
    gram: np.ndarray
    row: np.ndarray


def room_of(modal_system: ModalSystem) -> Room:
    """Fresh Room for a Plant."""
    faces, n = modal_system.faces.shape
    wide = series.MOST + 5
    fields = {
        "coefs": (wide, n),
        "waves": (3, wide),
        "polys": (faces + 3, wide),
        "nodes": (n, 4),
        "hulls": (series.DEEP + 2, series.WIDE),
        "held": (2,),
        "react": (faces, n),
        "reactions": (faces, wide),
        "orders": (faces, 2),
        "scales": (wide, n),
        "spans": (faces, wide),
        "turned": (faces, n),
        "mix": (faces, faces),
        "gram": (faces, faces),
        "row": (2, faces),
    }
    return cleared(Room(*(np.empty(fields.get(name, (faces,))) for name in Room._fields)))


def cleared(workspace: Room) -> Room:
    """A Room as it is before a run."""
    for part in workspace:
        part.fill(0.0)
    workspace.orders.fill(-1.0)
    return workspace


class Books(NamedTuple):
    """What a run sums: ledger (8,) work of the drive, viscous loss, integral of its |power|, friction work, energy
    dissipated, largest energy stored [J], pieces, 1 where an interface slipped by half or more; extremes (c, 2) [m] of
    the output per cycle; phasors (c, 2) of its drive-frequency part, real and imaginary, in the cycles where wanted
    (c,) is 1; limits (2,): travel [m], idle events."""

    ledger: np.ndarray
    extremes: np.ndarray
    phasors: np.ndarray
    wanted: np.ndarray
    limits: np.ndarray


def books_of(cycles: int, wanted, travel: float = np.inf) -> Books:
    """Empty Books of a run of so many cycles."""
    return Books(
        np.zeros(8),
        np.tile([np.inf, -np.inf], (cycles, 1)),
        np.zeros((cycles, 2)),
        np.array(wanted, float),
        np.array([travel, 0.0]),
    )
