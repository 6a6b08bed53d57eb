"""Periodic motion behind rigid elements (Coulomb friction), or none, by Newton's method on the map from event to event.

Between two events the motion is linear, so its derivative is the exponential of its system with the held slides taken
out. A perturbation dx moves an event by dt = -(grad e . dx)/e', so dx+ = R (dx + f- dt) - f+ dt with the motions f
before and after and R taking the rates of stopped slides out (saltation; Leine and Nijmeijer 2004, ch. 7). The
eigenvalues of the product are the Floquet multipliers.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...core import InitialState, ModalBasis, PatchfemError, frozen_array
from ..periodic import Grows, Mapped, Shooting
from . import histories

LONGEST = 400  # cycles of a run where Newton's method leads away


@dataclass(frozen=True, eq=False, slots=True)
class Steady:
    """A motion that repeats from period to period.

    start: state at phase 0 of the drive; residual: |state after a period - start| over the size of the motion;
    multipliers (2n,) complex, largest first: stable where all are < 1 in magnitude (a stuck slide that may rest
    anywhere in a range keeps a 1); amplitude [m]: half the peak-to-peak output; regime: "stuck", "sliding" (no stop
    lasts), "n stops" per period of the interface with the most, or "unbounded"; stops (i,) that last, per period;
    alone: no two events coincide, else the multipliers hold for one order of them; iterations of Newton's method.
    Unbounded: start is the last state of the run, residual and multipliers are those there.
    """

    start: InitialState
    residual: float
    multipliers: np.ndarray
    amplitude: float
    regime: str
    stops: tuple
    alone: bool
    iterations: int


class Map(NamedTuple):
    """Map of the state x = (z, v) (2n,) over some periods: its end, its derivative slope (2n, 2n), signs of slip (k, i)
    in its pieces, which of them rub (i,), half the peak-to-peak output [m], sizes (2n,) of the state on the way, first
    (n, n): projector of its first piece, and alone as in Steady."""

    end: np.ndarray
    slope: np.ndarray
    signs: np.ndarray
    rubs: np.ndarray
    swing: float
    sizes: np.ndarray
    first: np.ndarray
    alone: bool


class Stretch:
    """Motion from one event to the next: the slides that are held, and the forces of the others.

    run: the run; row, after: its first row and the first one behind it, None at the end; span [s].
    """

    def __init__(self, run, row, after, span: float):
        modes = run.modes
        modal_system = run.modal_system
        n = run.modes.omega.size
        self.run = run
        self.row = row
        self.after = after
        self.span = span
        at = run._at(0, 0)
        columns = row[at:].reshape(len(run.groups), run.kernels.EACH)
        self.held = np.isinf(columns[:, 1])
        self.signs = columns[:, 7]
        rows = modal_system.faces[self.held]
        self.pinv = np.linalg.pinv(rows, rcond=1e-10)
        self.project = np.eye(n) - self.pinv @ rows
        if len(rows) and np.abs(self.project).max() < 1e-9:
            self.project = np.zeros((n, n))
        self.given = np.where(self.held, 0.0, columns[:, 0]) @ modal_system.faces / modes.mass
        self.square = np.diag(modes.omega**2)
        self.dampers = np.asarray(modes.damping_matrix, float)

    def slope(self) -> np.ndarray:
        """Derivative (2n, 2n) of the state at the end to that at the start."""
        n = len(self.square)
        p = self.project
        left = np.block([[np.zeros((n, n)), p], [-p @ self.square, -p @ self.dampers]])
        return exponential(left * self.span) @ self.taken_out()

    def taken_out(self) -> np.ndarray:
        """Derivative (2n, 2n) of a state whose held slides come to rest to what it was."""
        out = np.eye(2 * len(self.square))
        out[len(self.square) :, len(self.square) :] = self.project
        return out

    def acceleration(self, z, v, push: float) -> tuple:
        """(acceleration (n,) [m s-2], that without the reactions) at a state under a drive [m s-2]."""
        pull = -self.square @ z - self.dampers @ v - self.run.modes.base * push - self.given
        return self.project @ pull, pull

    def saltation(self, later: "Stretch") -> tuple:
        """(derivative (2n, 2n) of the state after the event at the end to that before it, whether only one slide
        changed by itself)."""
        run = self.run
        modes = self.run.modes
        n = len(self.square)
        row = later.row
        z = row[run.kernels.HEAD : run.kernels.HEAD + n]
        v = row[run.kernels.HEAD + n : run.kernels.HEAD + 2 * n]
        part = run.drive.segments[0]
        push = part.constant + part.amplitude * np.sin(row[2])
        rise = part.amplitude * part.omega * np.cos(row[2])
        before, pull = self.acceleration(z, v, push)
        changed = self.signs != later.signs
        face, stops = _what_happened(self, later, changed, modes.mass * pull @ self.pinv)
        gradient = np.zeros(2 * n)
        static = run.table.static[face]
        kinetic = run.table.kinetic[face]
        if stops:
            gradient[n:] = run.modal_system.faces[face]
            speed = float(run.modal_system.faces[face] @ before)
        else:
            react = self.pinv[:, np.flatnonzero(self.held) == face][:, 0]
            gradient[:n] = -react @ self.square
            gradient[n:] = -react @ self.dampers
            speed = float(gradient[:n] @ v + gradient[n:] @ before - react @ modes.base * rise)
        jump = np.zeros(2 * n)
        if stops or static != kinetic:  # else nothing jumps at a release
            jump[n:] = before - later.acceleration(z, v, push)[0]
        out = later.taken_out()
        if speed != 0:
            out -= np.outer(out @ jump, gradient) / speed
        others = [
            a not in (0, b) for f, (a, b) in enumerate(zip(self.signs, later.signs)) if f != face
        ]
        return out, not any(others)


def exponential(left) -> np.ndarray:
    """Exponential of a small matrix (2n, 2n) of coordinates and rates: Taylor's series of 2^-s of it, squared s times.

    That of SciPy wakes the threads of its linear algebra, which takes up to milliseconds for two rows.
    """
    half = len(left) // 2
    sizes = np.abs(left)
    # of rates
    scale = np.sqrt(max(float(sizes.max()), 1e-300) / max(float(sizes[:half].max()), 1e-300))
    weight = np.repeat([scale, 1.0], half)
    even = left * (weight[:, None] / weight)
    times = max(0, int(np.ceil(np.log2(max(float(np.abs(even).sum(axis=0).max()), 1e-300)))) + 1)
    even = even / 2.0**times
    out = np.eye(len(left))
    for k in range(16, 0, -1):
        out = np.eye(len(left)) + even @ out / k
    for _ in range(times):
        out = out @ out
    return out * (weight / weight[:, None])


def _what_happened(one: Stretch, later: Stretch, changed, reactions) -> tuple:
    """(interface of the event between two stretches, whether its slip came to rest); reactions (h,) [N] of the held
    ones."""
    turned = np.flatnonzero(changed & (one.signs != 0))
    if turned.size:
        return int(turned[0]), True
    limits = one.run.table.static[one.held]
    near = np.abs(np.abs(reactions) / np.maximum(limits, 1e-300) - 1)
    near[~changed[one.held]] = np.inf
    return int(np.flatnonzero(one.held)[int(np.argmin(near))]), False


def period_map(modes: ModalBasis, drive, groups, state, periods: int = 1) -> Map:
    """The map of a state (2n,) over whole drive periods, with its slope (2n, 2n).

    state: modal displacements and velocities where the drive begins; groups: Elements of every interface, rigid ones
    alone. The slope is that of the stretches between events times the jump at each (saltation matrices).
    """
    n = modes.omega.size
    run = histories.started(
        modes, drive, groups, periods, periods, start=InitialState(state[:n], state[n:])
    )
    kept = []
    run.until(periods, lambda done: kept.append(done.copy()))
    rows = np.concatenate(kept)
    begins = [0, *(k for k in np.flatnonzero(rows[:, 4] >= run.kernels.SWITCHED) if k)]
    parts = [
        Stretch(run, rows[a], None, float(rows[a:b, 1].sum()))
        for a, b in zip(begins, [*begins[1:], len(rows)])
    ]
    slope = parts[0].slope()
    alone = True
    for before, after in pairwise(parts):
        if np.any(before.signs != after.signs):
            jump, own = before.saltation(after)
            slope = jump @ slope
            alone = alone and own
        slope = after.slope() @ slope
    owner = np.repeat(np.arange(len(rows)), 3)
    dense = run.dense_values(rows, owner, np.tile([0.0, 0.5, 1.0], len(rows)) * rows[owner, 1])
    sizes = [max(float(np.abs(part).max()), 1e-300) for part in (dense[:, :n], dense[:, n : 2 * n])]
    low = run.books.extremes[:, 0].min()
    high = run.books.extremes[:, 1].max()
    return Map(
        run.motion.ravel().copy(),
        slope,
        np.array([part.signs for part in parts]),
        run.table.static > 0,
        float(high - low) / 2,
        np.repeat(sizes, n),
        parts[0].project,
        alone,
    )


def steady(
    modes: ModalBasis,
    drive,
    groups,
    start: InitialState | None = None,
    cycles: int = 30,
    periods: int = 1,
) -> Steady:
    """Periodic response to a sine from rest or `start`, after `cycles` of a run that bring it near.

    drive: one Segment of a sine; groups: as of `period_map`. NotConverged as `periodic.Shooting.repeating`,
    PatchfemError for a drive that does not repeat.
    """
    if len(drive.segments) != 1:
        raise PatchfemError(
            "drive: a periodic response can be computed only if the drive is a single sine without "
            'end; for this drive use accuracy.method = "march"'
        )
    n = modes.omega.size
    begin = np.zeros(2 * n) if start is None else np.concatenate([start.z, start.v])
    shooting = Slips(modes, drive, groups, periods)
    try:
        mapped, used = shooting.repeating(shooting.run(begin, cycles), (2 * cycles, LONGEST))
    except Grows as found:
        return _result(found.mapped, n, "unbounded", found.steps)
    return _result(mapped, n, None, used)


class Slips(Shooting):
    """The map from event to event over whole periods of a drive; arguments as `steady`."""

    def __init__(self, modes: ModalBasis, drive, groups, periods: int = 1):
        self.modes = modes
        self.drive = drive
        self.groups = groups
        self.periods = periods
        part = drive.segments[0]
        self.moved_by = max(
            abs(part.amplitude) / part.omega**2 * float(np.abs(modes.base).max()), 1e-300
        )

    def mapped(self, point) -> Mapped:
        """The map of a state (2n,)."""
        found = period_map(self.modes, self.drive, self.groups, point, self.periods)
        return Mapped(
            point,
            found,
            found.slope,
            found.sizes,
            (point - found.end) / found.sizes,
            found.sizes[0] / self.moved_by,
        )

    def moved(self, mapped: Mapped, step):
        """The state a step away, whose held slides stay at rest."""
        n = self.modes.omega.size
        out = mapped.point + step
        out[n:] = mapped.found.first @ out[n:]
        return out

    def after(self, mapped: Mapped, periods: int):
        """The state after some periods of the run from that of a map."""
        return self.run(mapped.point, periods)

    def run(self, state, periods: int):
        """The state after some periods of the run."""
        n = self.modes.omega.size
        run = histories.started(
            self.modes, self.drive, self.groups, periods, start=InitialState(state[:n], state[n:])
        )
        run.until(periods)
        return run.motion.ravel().copy()


def _result(mapped: Mapped, n: int, regime, used: int) -> Steady:
    one = mapped.found
    state = mapped.point
    stops = tuple(
        int(k) for k in np.count_nonzero((one.signs[:-1] != 0) & (one.signs[1:] == 0), axis=0)
    )
    if regime is None:
        signs = one.signs[:, one.rubs]
        most = max(stops)
        slips = bool(np.any(signs != 0)) or signs.shape[1] == 0
        rests = bool(np.any(signs == 0))
        regime = (
            "stuck"
            if not slips
            else "sliding"
            if not rests
            else f"{most} stop{'s' if most != 1 else ''}"
        )
    return Steady(
        InitialState(frozen_array(state[:n]), frozen_array(state[n:])),
        mapped.miss,
        frozen_array(mapped.multipliers(), complex),
        one.swing,
        regime,
        stops,
        one.alone,
        used,
    )
