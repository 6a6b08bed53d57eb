"""Periodic motions by Newton's method on the map of a period (shooting), and their Floquet multipliers.

The unknowns are the modes, the states of the laws, and those reversal points of the laws that the period moves.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .. import kernel_cache
from ..core import NotConverged
from .cases import Case, make_arrays
from .laws import LAWS, masing, mirror_state
from .records import (
    N_FACE_INTEGRALS,
    N_INTEGRALS,
    Clock,
    Cycle,
    Face,
    LawNumbers,
    Memory,
    Record,
    Setting,
    State,
    Status,
)
from .runs import MESSAGES, Motion, run_case

MASING = LAWS.index("masing")  # number of the law whose memory are reversal points
N_PIECES = 4  # number of pieces of its curve among its numbers

N_FIRST_CYCLES = 8  # cycles before the first correction
N_RELAXED = 6  # cycles without a correction after a search that failed, and twice as many after the next one
MAX_RELAXED = 200  # largest number of these cycles
MAX_CHANGE = 100.0  # largest change over a periodic motion, relative to the step tolerance
# Largest change over a periodic motion with laws of many elements, whose map has kinks close together.
MAX_KINKED_CHANGE = 1e-6
N_CHECKED = 10  # periods that such a motion is followed
# Largest Floquet multiplier of a stable motion; above 1, because the derivatives of the map are differences.
MAX_STABLE_MULTIPLIER = 1 + 1e-3
# Distance of a multiplier from 1 that differences do not resolve; a mode with a damping ratio of 3e-7 has it.
UNDAMPED_TOL = 2e-6
# Cycles of each of three runs, in which a growing motion increases by similar amounts
N_GROWTH_CYCLES = 60
MIN_STOP = 1e-9  # shortest rest of rigid friction that is counted, in periods


class PeriodicMotion(NamedTuple):
    """Periodic motion of a case.

    - run: its motion over a period, with measures and energies of this period
    - change: largest change of the state over a period, relative to its scale; it has converged below `tolerance`
    - error: distance of the state from that of the periodic motion, relative to its scale
    - tolerance: largest change at which the motion counts as periodic
    - multipliers: Floquet multipliers; without those of states that a period determines alone
    - n_periods: number of periods that were computed
    - grows: whether the motion from the start grows for ever, so that none is periodic
    - map: derivatives of the map of a period near the motion, None if the last correction had none
    """

    run: Motion
    change: float
    error: float
    tolerance: float
    multipliers: np.ndarray
    n_periods: int
    grows: bool = False
    map: "PeriodMap | None" = None

    @property
    def period(self) -> float:
        """Duration of a period [s]."""
        return float(self.run.case.rig.settings[Setting.PERIOD])

    @property
    def start(self) -> "Start":
        """Start of the search for a similar motion."""
        return Start(self.run.final, self.map)

    @property
    def is_stable(self) -> bool:
        """Whether all multipliers are within the unit circle."""
        return bool(np.abs(self.multipliers).max(initial=0.0) < MAX_STABLE_MULTIPLIER)


def find_periodic_motion(
    case: Case,
    *,
    n_first: int = N_FIRST_CYCLES,
    start: State | None = None,
    has_kinks: bool = False,
    is_undamped: bool = False,
    odd_laws: Sequence[LawNumbers] = (),
) -> PeriodicMotion:
    """Find the periodic motion that follows some first cycles of a case.

    Parameters
    ----------
    case : Case
        Its start is that of the first cycles; its schedule is not used.
    n_first : int
        Number of first cycles.
    start : State, optional
        State of another motion of the same rig at the start of a period, from which the first cycles begin.
    has_kinks : bool
        Whether a law has many elements, so that a change of MAX_KINKED_CHANGE counts as none. The derivatives of the
        map are then those between two kinks; stability and error follow from N_CHECKED periods of the motion itself.
    is_undamped : bool
        Whether a free motion without friction does not decay. A motion from rest that grows for ever is then found first,
        because the periods of a growing motion would lead nowhere.
    odd_laws : sequence of LawNumbers
        Laws of a rig whose motions are symmetric, see `Shooting`.

    Raises
    ------
    NotConverged
        If the search needs too many steps.
    """
    # Smallest ratio of a periodic motion that is never reached to the motion after the runs of `_measure_growth`
    min_size_ratio = 1e3
    # Steps of the search for a periodic motion beside these runs, relative to theirs
    search_steps_ratio = 3.0
    growth = _measure_growth(case) if is_undamped and start is None else None
    shooting = Shooting(case, odd_laws)
    if start is not None:
        shooting.state = start
    if growth is None or not growth.size:
        motion = _search(shooting, n_first, MAX_RELAXED, has_kinks=has_kinks)
    else:
        # A growing motion leads nowhere, so that the search beside it is short.
        shooting.limit_steps(search_steps_ratio * growth.n_steps)
        try:
            motion = _search(shooting, n_first, N_RELAXED, has_kinks=has_kinks)
        except NotConverged:
            shooting = Shooting(case, odd_laws)
            before = shooting.state
            shooting.relax(1)
            change = shooting.measure_change(before)
            run = run_case(shooting.case)
            motion = PeriodicMotion(run, change, np.inf, 0.0, np.zeros(0), 1)

    # A periodic motion far beyond the growing one is never reached.
    has_converged = motion.change < motion.tolerance
    largest = np.abs(motion.multipliers).max(initial=0.0)
    if has_converged and largest <= 1 - UNDAMPED_TOL:
        return motion
    growth = growth or _measure_growth(case)
    size = shooting.find_size(motion.run.final) if has_converged else np.inf
    return motion._replace(grows=bool(growth.size and size > min_size_ratio * growth.size))


def _search(
    shooting: "Shooting", n_first: int, max_relaxed: int, *, has_kinks: bool
) -> PeriodicMotion:
    """Return the motion with the smallest change over a period, and its multipliers.

    Parameters
    ----------
    shooting : Shooting
        Map of a period and the state from which the search begins.
    n_first : int
        Number of first cycles.
    max_relaxed : int
        Largest number of cycles after a correction that did not help.
    has_kinks : bool
        As in `find_periodic_motion`.
    """
    shooting.relax(n_first - 1)
    tolerance = MAX_CHANGE * float(shooting.case.rig.settings[Setting.RTOL])
    if has_kinks:
        tolerance = max(tolerance, MAX_KINKED_CHANGE)
    before, change = shooting.converge(tolerance, max_relaxed)
    if not shooting.has_exact_map:
        shooting.map = None
    if has_kinks:
        multipliers, error = shooting.check(before, tolerance)
    else:
        multipliers, error = shooting.find_multipliers(before)
        # Other differences do not pass the same kink of a law.
        for factor in (-1.0, 30.0, -1.0):
            if np.abs(multipliers).max(initial=0.0) < MAX_STABLE_MULTIPLIER:
                break
            shooting.difference *= factor
            shooting.map = None
            found = [(multipliers, error), shooting.find_multipliers(before)]
            multipliers, error = min(found, key=lambda pair: np.abs(pair[0]).max())

    # Near the periodic motion one more correction costs a period, because the derivatives are known.
    if not has_kinks and change < tolerance and error > change:
        shooting.correct(before)
        nearer = shooting.state
        shooting.relax(1)
        nearer_change = shooting.measure_change(nearer)
        if nearer_change < change and shooting.has_same_regime(nearer):
            before = nearer
            change = nearer_change
            error = shooting.find_multipliers(nearer)[1]

    # The measures are those of a period from there on.
    run = run_case(shooting.whole, start=before)
    return PeriodicMotion(
        run,
        change,
        error,
        tolerance,
        multipliers,
        shooting.n_periods,
        map=shooting.map,
    )


def follow_periodic_motion(
    case: Case, start: "Start", odd_laws: Sequence[LawNumbers] = ()
) -> PeriodicMotion:
    """Find the periodic motion of a case from that of a similar case, without its stability and the error of its state.

    The derivatives of the similar motion serve as long as the corrections with them converge, so that the motion after a
    small change takes four periods.

    Parameters
    ----------
    case : Case
        Its start and schedule are not used.
    start : Start
        State near the start of the motion, and the derivatives of a similar one.
    odd_laws : sequence of LawNumbers
        Laws of a rig whose motions are symmetric, see `Shooting`.

    Returns
    -------
    PeriodicMotion
        A change of MAX_KINKED_CHANGE over its period counts as none, because an interface that hardly slips comes to rest
        only after hundreds of periods.
    """
    shooting = Shooting(case, odd_laws)
    shooting.state, shooting.map = start
    shooting.relax(1)
    tolerance = MAX_CHANGE * float(case.rig.settings[Setting.RTOL])
    before, change = shooting.converge(tolerance, N_RELAXED, MAX_KINKED_CHANGE)

    # One more correction, after which the change is a small part of it at the start of the measured period. From a start
    # beyond its last reversal, where the force exceeds the friction limit, this period begins a period later.
    if shooting.map is not None:
        shooting.correct(before)
        if shooting.is_possible():
            shooting.relax(int(not shooting.follows_reversals(shooting.state)))
            before = shooting.state
    return PeriodicMotion(
        run_case(shooting.whole, start=before),
        change,
        np.inf,
        MAX_KINKED_CHANGE,
        np.zeros(0),
        shooting.n_periods,
        map=shooting.map,
    )


class Start(NamedTuple):
    """State from which a search for a periodic motion begins, and the derivatives of the map of a period near it."""

    state: State
    map: "PeriodMap | None" = None

    def interpolate(self, other: "Start", fraction: float) -> "Start":
        """Return the start at a fraction of the way to that of another motion.

        It is the nearer one where the laws are in different regimes, or remember different numbers of reversal points.
        """
        near = self if fraction < 0.5 else other
        first = self.state
        second = other.state
        columns = [Memory.DIRECTION, Memory.CONTACT, Memory.FLAG, Memory.COUNT]
        if not np.array_equal(first.memory[:, columns], second.memory[:, columns]):
            return near
        state = copy_state(near.state)
        for target, low, high in zip(state[:2], first, second):
            target[...] = (1 - fraction) * low + fraction * high
        return near._replace(state=state)


class _Growth(NamedTuple):
    """Motion from the start of a case that may grow for ever.

    - size: largest coordinate or velocity after some time, 0 if the motion does not grow for ever
    - n_steps: steps of the engine up to there
    """

    size: float
    n_steps: float


def _measure_growth(case: Case) -> _Growth:
    """Return whether the motion from the start of a case increases by similar amounts in equal times, and its size."""
    # Smallest increase in N_GROWTH_CYCLES, relative to the motion, that is growth
    min_growth = 1e-6
    # Smallest ratio of the increases in the last and in the second run
    min_growth_ratio = 0.5
    shooting = Shooting(case)
    sizes = []
    for _ in range(3):
        shooting.relax(N_GROWTH_CYCLES)
        sizes.append(shooting.find_size(shooting.state))
    first, second = np.diff(sizes)
    is_moving = sizes[0] > case.rig.scales[0]
    is_growing = first > min_growth * sizes[0] and second > min_growth_ratio * first
    return _Growth(sizes[-1] if is_moving and is_growing else 0.0, shooting.n_steps)


class Shooting:
    """State of a motion at the start of a period, and its map.

    The periods of a search are not measured, which takes more than half of the time of a period; a class whose map needs
    the measures of a period sets `measures_periods`.

    Parameters
    ----------
    case : Case
        Rig, and the state from which the search begins.
    odd_laws : sequence of LawNumbers
        Laws of all interfaces, if the second half of a periodic motion is the first one with the opposite sign. The map is
        then that of half a period, whose end is given the opposite sign.
    """

    measures_periods = False

    def __init__(self, case: Case, odd_laws: Sequence[LawNumbers] = ()):
        # Smallest step of the derivatives of the map, relative to the scale of an unknown
        min_difference = 1e-6
        settings = case.rig.settings
        self.period = float(settings[Setting.PERIOD])
        self.odd_laws = odd_laws
        self.whole = replace(
            case, ends=np.array([self.period]), windows=np.zeros(1), samples=np.zeros(0)
        )
        end = self.period / 2 if odd_laws else self.period
        self.case = replace(self.whole, ends=np.array([end]))
        self.state = make_arrays(case)[0]
        # All periods use the same arrays, because a call looks up the addresses of new ones.
        self.work, self.record = make_arrays(self.case)
        if not self.measures_periods:
            self.record.cycles[:, Cycle.WINDOW] = -1.0
        self.blank = Record(*(array.copy() for array in self.record))
        self.run = kernel_cache.load_compiled_module("event_driven.engine_kernels").run_case
        # Interfaces whose laws remember reversal points
        self.loops = np.flatnonzero(case.rig.faces[:, Face.LAW] == MASING)
        # Signs of all entries of the state of the opposite motion
        self.signs = State(*(np.ones_like(array) for array in self.state))
        mirror_state(self.signs, case.rig.modes.shape[1], odd_laws)
        self.n = case.y.size - N_INTEGRALS - N_FACE_INTEGRALS * case.rig.faces.shape[0]
        self.n_periods = 0
        self.n_steps = 0.0
        self.map: PeriodMap | None = None
        # Whether the derivatives are those near the motion that was found
        self.has_exact_map = False
        # The errors of a period, of the size of the step tolerance, and of the difference are equal.
        self.difference = max(min_difference, float(settings[Setting.RTOL]) ** 0.5)

    def limit_steps(self, max_steps: float) -> None:
        """Set the largest number of steps of all periods."""
        settings = self.case.rig.settings.copy()
        settings[Setting.MAX_STEPS] = max_steps
        self.case = replace(self.case, rig=self.case.rig._replace(settings=settings))

    def find_size(self, state: State) -> float:
        """Return the largest coordinate or velocity of the modes in a state."""
        return float(np.abs(state.y[: 2 * self.case.rig.modes.shape[1]]).max())

    def find_slides(self, state: State) -> np.ndarray:
        """Return the relative displacements (i,) [m] of the interfaces in a state."""
        return self.case.rig.rows[0] @ state.y[: self.case.rig.modes.shape[1]]

    def advance(self, state: State) -> State:
        """Return the state a period after another one, whose clock starts at 0.

        Raises
        ------
        NotConverged
            If all periods of the search take more than `Setting.MAX_STEPS` steps.
        """
        settings = self.case.rig.settings
        for target, source in zip((*self.work, *self.record), (*state, *self.blank)):
            target[...] = source
        self.record.cycles[:, Cycle.END] = self.case.ends
        state = self.work
        state.clock[:] = 0.0
        state.clock[Clock.STEP] = 0.1 * settings[Setting.LONGEST_STEP]
        state.clock[Clock.N_STEPS] = self.n_steps
        self.run(self.case.rig, state, self.record)
        self.n_periods += 1
        self.n_steps = state.clock[Clock.N_STEPS]
        if self.n_steps > settings[Setting.MAX_STEPS]:
            cause = MESSAGES[Status.TOO_MANY_STEPS].format(steps=settings[Setting.MAX_STEPS])
            raise NotConverged(
                f'no periodic motion was found: {cause}, or accuracy.method = "auto"'
            )
        if self.odd_laws:
            state.y[:] *= self.signs.y
            state.memory[:] *= self.signs.memory
        return copy_state(state)

    def relax(self, count: int) -> None:
        """Advance the motion by some periods."""
        for _ in range(count):
            self.state = self.advance(self.state)

    def converge(
        self, tolerance: float, max_relaxed: int, kinked: float = 0.0
    ) -> tuple[State, float]:
        """Correct the state until a period changes it by less than a tolerance and keeps the regimes of the laws.

        Periods of the motion itself follow a search that has failed, twice as many after the next one. They are many for an
        interface that hardly slips, where the steps of a stuck one lead far away.

        Parameters
        ----------
        tolerance : float
            Largest change over a period, relative to the motion.
        max_relaxed : int
            Largest number of these periods in a row.
        kinked : float
            As in `find_fixed_point`.

        Returns
        -------
        before : State
            Last state at the start of a period.
        change : float
            Change over this period, relative to the scale of the state.
        """
        # Searches for a motion, between which it is followed for some periods
        max_searches = 10
        n_relaxed = N_RELAXED
        for _ in range(max_searches):
            state = self.state
            found = self.find_fixed_point(tolerance, kinked)
            if found is not None:
                return found[0], self.measure_change(found[0])
            self.state = state
            self.map = None
            self.relax(n_relaxed)
            n_relaxed = min(2 * n_relaxed, max_relaxed)
        before = self.state
        self.relax(1)
        return before, self.measure_change(before)

    def find_excess(self, step, start) -> float:
        """Return the length of a Newton step (k,) from a packed state (k,), relative to its limit; 0 without one."""
        return 0.0

    def find_fixed_point(
        self, tolerance: float, kinked: float = MAX_KINKED_CHANGE
    ) -> tuple[State, int] | None:
        """Find a motion that meets the conditions by Newton's method, from the present state and derivatives.

        Parameters
        ----------
        tolerance : float
            Largest change over a period, relative to the motion.
        kinked : float
            The same where it no longer falls, because kinks of the laws are close together.

        Returns
        -------
        tuple or None
            State at the start of the period, and number of periods; None without convergence.
        """
        # Newton steps to a motion from a similar one
        max_newton_steps = 20
        # Largest ratio of the changes over a period after and before a correction at which the derivatives of this
        # correction are used again. The ratio is about the relative change of the derivatives.
        max_remainder = 1e-3
        # Largest ratio of the changes over a period after and before a step at which the derivatives are updated.
        # Further steps with these derivatives take a period each, new derivatives take one for each unknown.
        max_broyden_ratio = 0.3
        # Largest number of shortened Newton steps, and of Newton steps with new derivatives, before a search is given up
        max_detours = 3
        step = last_residual = np.zeros(0)
        best = np.inf
        n_long = n_maps = n_regimes = 0
        is_new = False
        self.has_exact_map = False
        for count in range(1, max_newton_steps + 1):
            before = self.state
            self.relax(1)
            change = self.measure_change(before)
            if change < tolerance or best <= change < kinked:
                self.has_exact_map &= change <= max_remainder * best
                # In another regime the reversal points are those that the period has left. A law that sticks may keep the
                # direction of its last slip, which half a period reverses.
                if self.odd_laws or self.has_same_regime(before):
                    return before, count
                self.map = None
                best = np.inf
                continue
            if not np.isfinite(change):
                return None
            if self.measures_periods and n_regimes < max_detours and not self.odd_laws:
                # A start in another regime gets the reversal points that the period has left.
                if not self.has_same_regime(before):
                    n_regimes += 1
                    self.state.y[: self.n] = before.y[: self.n]
                    continue

            # After a correction that helped, its residual updates the derivatives. One with new derivatives that did not
            # help began too far away.
            start = self.pack(before)
            residual = self.pack(self.state) - start
            if is_new and not change < best:
                return None
            is_new = not change < max_broyden_ratio * best
            if is_new or change > max_broyden_ratio:
                n_maps += is_new
                self.map = None
            elif change > max_remainder * best:
                self.map = self.map.update(step, residual - last_residual)
            best = change
            last_residual = residual
            self.has_exact_map = self.map is None
            advanced = self.state
            self.correct(before)
            if self.state is advanced:
                return None
            if not self.is_possible():
                self.state = advanced
                self.map = None
                best = np.inf
                continue
            step = self.pack(self.state) - start

            # A long step is shortened, because the motion is then far away.
            excess = self.find_excess(step, start)
            n_long += excess > 1
            if max(n_long, n_maps) > max_detours or not np.isfinite(step).all():
                return None
            if excess > 1:
                step /= excess
                self.state = self.unpack(self.state, start + step)
        return None

    def is_possible(self) -> bool:
        """Return whether no law of reversal points remembers forces beyond its friction limit, or below it of one element.

        With such forces a loop far away from the motion would repeat itself. One element reverses at its limit alone.
        """
        # Largest force at a reversal point after a correction, relative to the friction limit, which no motion exceeds;
        # corrections are exact to MAX_KINKED_CHANGE.
        max_force_ratio = 1 + 10 * MAX_KINKED_CHANGE
        faces = self.case.rig.faces
        for i in self.loops:
            memory = self.state.memory[i]
            forces = memory[Memory.STACK + 1 : Memory.STACK + 2 * int(memory[Memory.COUNT]) : 2]
            limit = faces[i, Face.NUMBERS + masing.LIMIT]
            if np.abs(forces).max(initial=0.0) > max_force_ratio * limit:
                return False
            least = np.abs(forces).min(initial=np.inf)
            if _has_single_element(faces[i]) and least * max_force_ratio < limit:
                return False
        return True

    def check(self, before: State, tolerance: float) -> tuple[np.ndarray, float]:
        """Follow a motion that was found for some periods.

        Returns
        -------
        multipliers : (0,) or (1,) array
            Growth of the distance per period if it becomes much larger than the tolerance.
        error : float
            Distance after these periods, enlarged for a distance that decays slowly.
        """
        # Largest distance after the N_CHECKED periods, relative to the change of a period that counts as none
        check_factor = 10.0
        self.state = before
        self.relax(N_CHECKED)
        distance = self.measure_change(before)
        if distance <= check_factor * tolerance:
            return np.zeros(0), check_factor * distance
        return np.array([(distance / tolerance) ** (1 / N_CHECKED)]), np.inf

    def scales(self) -> np.ndarray:
        """Return the magnitudes (n,) of the modes and law states at the start of a period."""
        scale = np.maximum(np.abs(self.state.y[: self.n]), self.case.rig.scales[: self.n])
        n_modes = self.case.rig.modes.shape[1]
        omega = self.case.rig.settings[Setting.OMEGA]
        # Displacements and velocities share their magnitudes, because either may vanish at the start of a period.
        size = max(scale[:n_modes].max(), scale[n_modes : 2 * n_modes].max() / omega)
        scale[:n_modes] = size
        scale[n_modes : 2 * n_modes] = size * omega
        return scale

    def measure_change(self, before: State) -> float:
        """Return the change of the state since another one, relative to its scale."""
        change = np.abs(self.state.y[: self.n] - before.y[: self.n])
        return float((change / self.scales()).max())

    def has_same_regime(self, before: State) -> bool:
        """Return whether the laws are in the regimes of another state, whose reversal points may be fewer.

        A loop that round-off makes smaller with each period adds reversal points for ever.
        """
        columns = [Memory.DIRECTION, Memory.CONTACT, Memory.FLAG]
        return np.array_equal(self.state.memory[:, columns], before.memory[:, columns])

    def pack(self, state: State) -> np.ndarray:
        """Return the n states of the motion and the reversal points in one array (k,)."""
        return np.concatenate([state.y[: self.n], state.memory[:, Memory.STACK :].ravel()])

    def unpack(self, state: State, packed) -> State:
        """Return a copy of a state with the values of `pack`."""
        state = copy_state(state)
        stack = state.memory[:, Memory.STACK :]
        state.y[: self.n] = packed[: self.n]
        stack[:] = packed[self.n :].reshape(stack.shape)
        return state

    def find_usable(self, before: State) -> np.ndarray:
        """Return which entries (k,) of the packed state may be unknowns: not reversal points that come or go in a period."""
        counts = before.memory[:, Memory.COUNT, None]
        is_used = np.arange(before.memory.shape[1] - Memory.STACK) < 2 * counts
        is_used &= counts == self.state.memory[:, Memory.COUNT, None]
        return np.append(np.ones(self.n, bool), is_used)

    def find_unknowns(self, before: State) -> np.ndarray:
        """Return the indices of the unknowns in the packed state: what a period changes.

        Those of the known derivatives are kept, as long as they contain all that changes.
        """
        usable = self.find_usable(before)
        is_unknown = self.pack(self.state) != self.pack(before)
        is_unknown[: 2 * self.case.rig.modes.shape[1]] = True
        is_unknown &= usable
        if self.map is not None and usable[self.map.columns].all():
            is_known = np.zeros(usable.size, bool)
            is_known[self.map.columns] = True
            if not (is_unknown & ~is_known).any():
                return self.map.columns
        return np.flatnonzero(is_unknown)

    def differentiate(self, before: State) -> tuple["PeriodMap", np.ndarray]:
        """Return the derivatives of the map of a period from a state, and the change over this period, in scaled unknowns.

        The derivatives of the last correction are used again as long as `map` has them.
        """
        columns = self.find_unknowns(before)
        start = self.pack(before)
        end = self.pack(self.state)
        if self.map is None or not np.array_equal(self.map.columns, columns):
            scale = np.append(self.scales(), np.abs(start[self.n :]))[columns]
            slopes = np.empty((columns.size, columns.size))
            for k, column in enumerate(columns):
                # A state beyond the last reversal point of a law begins with another regime, so that its difference is
                # no derivative. The difference to the other side is taken then.
                for difference in (self.difference, -self.difference):
                    packed = start.copy()
                    packed[column] += difference * scale[k]
                    state = self.unpack(before, packed)
                    if self.follows_reversals(state):
                        break
                slopes[:, k] = self.find_change(state, end)[columns]
                slopes[:, k] /= difference * scale
            self.map = PeriodMap(columns, slopes, scale)
        return self.map, (end - start)[columns] / self.map.scale

    def follows_reversals(self, state: State) -> bool:
        """Return whether all laws with reversal points are beyond their last one in the direction of their motion."""
        slides = self.find_slides(state)
        for i in self.loops:
            memory = state.memory[i]
            count = int(memory[Memory.COUNT])
            slide = slides[i] - memory[Memory.ORIGIN]
            if (
                count
                and memory[Memory.DIRECTION] * (slide - memory[Memory.STACK + 2 * count - 2]) < 0
            ):
                return False
        return True

    def find_change(self, state: State, end) -> np.ndarray:
        """Return the change of the packed state after a period from that of another motion, `end`."""
        return self.pack(self.advance(state)) - end

    def find_multipliers(self, before: State) -> tuple[np.ndarray, float]:
        """Return the eigenvalues of the map of a period from a state, and the largest part of the next Newton step."""
        # Distance of a multiplier from 1, relative to the largest, that counts as none
        neutral_tol = 1e-9
        found, change = self.differentiate(before)
        if not np.isfinite(found.slopes).all():
            return np.full(change.size, np.nan), np.inf
        # A state that nothing determines, such as that of an interface at rest, has no error.
        step = _solve_newton(found, change, neutral_tol)
        multipliers = np.linalg.eigvals(found.slopes)
        return multipliers**2 if self.odd_laws else multipliers, float(
            np.abs(step).max(initial=0.0)
        )

    def correct(self, before: State) -> None:
        """Replace the state by a Newton step from another one, which a period takes to it.

        Regimes are those at the end of the period, where the motion has brought them. Without finite derivatives the state
        remains.
        """
        # Singular values below it, relative to the largest one, count as 0
        singular_tol = 1e-13
        period_map, change = self.differentiate(before)
        if not np.isfinite(period_map.slopes).all():
            return
        packed = self.pack(self.state)
        step = _solve_newton(period_map, change, singular_tol) * period_map.scale
        packed[period_map.columns] = self.pack(before)[period_map.columns] + step
        self.state = self.unpack(self.state, packed)


def _has_single_element(face) -> bool:
    """Return whether the law of a row of the table of interfaces is one spring that slips at its limit."""
    numbers = face[Face.NUMBERS :]
    return numbers[1] == masing.TURNS_FREELY and numbers[N_PIECES] == 1


class PeriodMap(NamedTuple):
    """Linear map of a period in k scaled unknowns.

    - columns: (k,) indices of the unknowns in the packed state and memory
    - slopes: (k, k) derivatives of the end of the period by its start
    - scale: (k,) sizes of the unknowns, by which they are divided
    """

    columns: np.ndarray
    slopes: np.ndarray
    scale: np.ndarray

    def update(self, step, change) -> "PeriodMap":
        """Return the map that gives a step of the unknowns the change of the residual that was found (Broyden 1965).

        Parameters
        ----------
        step, change : (n,) array
            Step in the packed state, and change of the difference between end and start of the period.
        """
        step = step[self.columns] / self.scale
        missing = change[self.columns] / self.scale + step - self.slopes @ step
        return self._replace(slopes=self.slopes + np.outer(missing, step) / (step @ step))


def _solve_newton(linear: PeriodMap, change, rcond: float) -> np.ndarray:
    """Return the Newton step (k,) to a state that a period does not change, from the change over a period (k,).

    `linear` is the map of the period. Singular values below the fraction `rcond` of the largest one count as 0, because
    the matrix is singular where a state does not matter, such as bonds that have long been forgotten.
    """
    return np.linalg.lstsq(np.eye(change.size) - linear.slopes, change, rcond=rcond)[0]


def copy_state(state: State) -> State:
    """Return an independent copy of a state."""
    return State._make([array.copy() for array in state])
