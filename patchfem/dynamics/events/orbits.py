"""Periodic motions at one drive after another, and what instruments see of them."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import InitialState, ModalBasis, NotConverged, Response
from ...cost_model import PYTHON_READ_FRACTION
from . import histories
from .elements import Memory
from .modal_system import books_of, past_of, plant_of
from .period import PeriodMap, Point
from .steady import turning

ROWS = 256  # pieces of half a period for which there is room at first


class Seen(NamedTuple):
    """A motion that repeats: point at phase 0 of the drive; largest absolute acceleration [m s-2] at the output and its
    first harmonic [m s-2]; displacement [m]: half the range of the gauge."""

    point: Point
    acceleration: float
    fundamental: complex
    displacement: float


class Orbits:
    """Motions of modes behind Elements of every interface, `groups`, that repeat under one sine after another and turn
    over after half a period.

    A call with a drive (core.SineDrive) and a Point near its motion, or None for rest, gives Seen; errors as
    `steady.steady`. A Point of other elements counts as none.
    """

    def __init__(self, modes: ModalBasis, groups):
        self.kernels = load("dynamics.events.march_kernels")
        self.one = PeriodMap(modes, groups)
        self.march = self.kernels.march
        self.peak = load("dynamics.events.dense_kernels").peak
        self.wide = self.kernels.HEAD + 2 * modes.omega.size + self.kernels.EACH * len(groups)
        self.rows = np.zeros((ROWS, self.wide))
        self.books = books_of(1, np.ones(1))
        self.forces = np.zeros(len(groups))
        self.past = past_of(self.one.modal_system, self.one.table)
        self._given(modes)

    def _given(self, modes: ModalBasis) -> None:
        self.modes = modes
        self.held = {}
        self.gauge = None if modes.gauge is None else plant_of(replace(modes, output=modes.gauge))

    def renewed(self, modes: ModalBasis, groups) -> bool:
        """Take other modes and elements in the same workspace; False, and nothing is taken, where it does not fit."""
        same = self.one.renewed(modes, groups)
        if same:
            self._given(modes)
        return same

    def __call__(self, drive, near: Point | None = None) -> Seen:
        one = self.one
        point = turning(one, drive, near if self._fits(near) else None)[0].point
        used, swing = self._half(drive, point, one.modal_system)
        self.peak.expect(PYTHON_READ_FRACTION * one.seconds / 2)
        high = self.peak.call_with_bound_args(
            self._held("peak", one.modal_system, float(drive.moving)), self.rows[:used]
        )
        first = (
            -2 * drive.omega**2 * complex(*self.books.phasors[0])
            - 1j * drive.acceleration * drive.moving
        )
        if self.gauge is not None:
            swing = self._half(drive, point, self.gauge)[1]
        return Seen(point, float(high), first, swing)

    def window(self, drive, point: Point) -> Response:
        """Histories of the period from a Point on."""
        n = self.one.n
        memory = self.one.placed(point)
        start = InitialState(point.motion[:n], point.motion[n:])
        return histories.simulate(
            self.modes, drive, self.one.groups, 1.0, 1, np.inf, 0, None, start, memory
        ).window

    def _fits(self, near: Point | None) -> bool:
        """Whether a Point is one of these modes and elements."""
        still = self.one.still
        count = self.one.table.count
        return (
            near is not None
            and near.motion.size == 2 * self.one.n
            and near.memory.at.shape == still.at.shape
            and np.array_equal(_all_of(near.memory), count)
        )

    def _half(self, drive, point: Point, modal_system) -> tuple:
        """(pieces, largest output [m]) of half a period from a Point, the pieces in `rows`; the other half turns
        over."""
        one = self.one
        books = self.books
        stop = (0.0, drive.period / 2)
        while True:
            one.begin(drive, point)
            self.march.expect(one.seconds / 2)
            books.ledger[:] = 0.0
            books.phasors[:] = 0.0
            books.limits[1] = 0.0
            books.extremes[:] = (np.inf, -np.inf)
            code, used = self.march.call_with_bound_args(self._held("march", modal_system), stop)
            if code == self.kernels.DONE:
                return used, float(max(books.extremes[0, 1], -books.extremes[0, 0]))
            if code != self.kernels.FULL:
                raise NotConverged(
                    "dynamics: within a period the contact changes between stick and slip again and "
                    "again without time passing"
                )
            self.rows = np.zeros((2 * len(self.rows), self.wide))
            self.held = {}

    def _held(self, name: str, modal_system, moving: float = 0.0) -> tuple:
        """What a compiled function is called with."""
        one = self.one
        key = (name, id(modal_system), moving)
        if key not in self.held:
            self.held[key] = (
                self.peak.held(modal_system, one.time_state, moving, one.workspace, self.forces)
                if name == "peak"
                else self.march.held(
                    one.motion,
                    modal_system,
                    one.table,
                    one.memory,
                    self.past,
                    one.time_state,
                    self.books,
                    one.workspace,
                    self.rows,
                )
            )
        return self.held[key]


def _all_of(memory: Memory) -> np.ndarray:
    """Elements (i,) that a memory speaks of: those of its outermost group, or all where all slip."""
    return np.where(memory.depth > 0, memory.upto[:, 0], memory.slipping)
