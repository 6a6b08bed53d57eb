"""Coulomb runs for tests: calls with friction limits instead of elements, and runs as phases between events."""

from dataclasses import dataclass

import numpy as np

from patchfem.dynamics import make_coulomb_elements
from patchfem.dynamics.events import histories
from patchfem.dynamics.events.positions_kernels import ROW_BEGIN, Column


def make_groups(modes, static, kinetic) -> list:
    """Return one rigid element per interface, from limits [N] that are scalars or have shape (i,)."""
    count = len(modes.interfaces)
    pairs = zip(np.broadcast_to(static, count), np.broadcast_to(kinetic, count))
    return [
        make_coulomb_elements(float(static_limit), float(kinetic_limit))
        for static_limit, kinetic_limit in pairs
    ]


def simulate(
    modes, drive, static, kinetic, cycles, window=10, travel=np.inf, progress=None, start=None
):
    """Call `histories.simulate` with Coulomb friction."""
    groups = make_groups(modes, static, kinetic)
    return histories.simulate(modes, drive, groups, cycles, window, travel, 0, progress, start)


@dataclass(frozen=True)
class Signal:
    """Weighted sum of columns of `dense_kernels.evaluate_rows` over a phase of a run.

    `rates` are the columns of its time derivative.
    """

    run: object
    rows: np.ndarray
    columns: tuple
    rates: tuple
    weights: tuple

    def evaluate(self, t):
        """Return values (j,) at times t (j,) [s] after the start of the phase."""
        return self._evaluate_columns(self.columns, np.asarray(t, float))

    def _evaluate_columns(self, columns, t):
        """Return the weighted sum of some columns at times t (j,) [s]."""
        at = self.rows[0, 0] + t
        owner = np.clip(
            np.searchsorted(self.rows[:, 0], at, side="right") - 1, 0, len(self.rows) - 1
        )
        # The offset within the cycle has more digits than the absolute time.
        since = np.concatenate([[0.0], np.cumsum(self.rows[:-1, 1])])
        tau = np.clip(t - since[owner], 0.0, self.rows[owner, 1])
        order = np.argsort(owner, kind="stable")
        out = np.empty((t.size, 2 * len(self.run.modes.omega) + 1 + 6 * len(self.run.groups)))
        out[order] = self.run.evaluate_rows(self.rows, owner[order], tau[order])
        return out[:, columns] @ np.array(self.weights)

    def __call__(self, t):
        """Return the value at one time t [s]."""
        return float(self.evaluate(np.array([t]))[0])

    def rate(self):
        """Return the time derivative as a signal."""
        return Signal(self.run, self.rows, self.rates, (), self.weights)


def combine_signals(signals, factors) -> Signal:
    """Return the sum of signals of the same phase, weighted with `factors`."""
    first = signals[0]
    return Signal(
        first.run,
        first.rows,
        sum((s.columns for s in signals), ()),
        sum((s.rates for s in signals), ()),
        tuple(float(f) for f in factors),
    )


@dataclass(frozen=True)
class Phase:
    """Motion between two events.

    It begins at `time` [s] with drive phase `theta` and lasts `span` [s]. directions: of slip (i,),
    0 in stick; modal: a Signal per coordinate; forces: of the interfaces [N].
    """

    time: float
    theta: float
    span: float
    directions: tuple
    modal: list
    forces: list
    rows: np.ndarray

    @property
    def direction(self) -> int:
        """Slip direction of the first interface."""
        return self.directions[0]

    @property
    def force(self) -> Signal:
        """Friction force of the first interface."""
        return self.forces[0]


def collect_rows(modes, drive, static, kinetic, cycles, start=None, begin=0) -> tuple:
    """Return the run and the rows of all its pieces, from rest or `start`; the clock begins at cycle `begin`."""
    groups = make_groups(modes, static, kinetic)
    event_run = histories.start_event_run(
        modes, drive, groups, cycles, int(cycles) + 2, start=start
    )
    event_run.time_state.now[0] = begin
    rows = []
    event_run.run_to(cycles, event_run._make_row_collector(rows))
    return event_run, np.concatenate(rows)


def run_phases(modes, drive, static, kinetic, duration, start=None) -> list:
    """Return the phases of a run of `duration` [s]; the last one ends there."""
    event_run, rows = collect_rows(modes, drive, static, kinetic, duration / drive.period, start)
    first_rows = np.flatnonzero(rows[:, 4] >= ROW_BEGIN.stick_or_slip)
    n = len(modes.omega)
    i = len(event_run.groups)
    phases = []
    for first, end in zip(
        [0, *first_rows[first_rows > 0]], [*first_rows[first_rows > 0], len(rows)]
    ):
        part = rows[first:end]
        directions = tuple(
            int(part[0, event_run._column_index(f, Column.DIRECTION)]) if group.static else 1
            for f, group in enumerate(event_run.groups)
        )
        modal = [Signal(event_run, part, (k,), (n + k,), (1.0,)) for k in range(n)]
        forces = [Signal(event_run, part, (2 * n + 1 + 6 * f + 2,), (), (1.0,)) for f in range(i)]
        phases.append(
            Phase(part[0, 0], part[0, 2], part[:, 1].sum(), directions, modal, forces, part)
        )
    return phases


def release_phases(result) -> np.ndarray:
    """Return the phases, modulo pi, at which the first interface is released in the window of an EventRunResult."""
    log = result.log
    is_in_window = (
        (log.interface == 0) & (np.abs(log.kind) == 1) & (log.time > result.window.time[0])
    )
    return log.phase[is_in_window] % np.pi
