"""March of cases with one mode, one interface and a sinusoidal drive; each case takes one vector lane."""

from functools import cache
from typing import NamedTuple

import numpy as np

from ...compiled import instantiate, load
from . import rows_kernels as rows
from .rows_kernels import Row

LANES_PACKAGE = "dynamics.lanes"
# Laws of the Masing (Iwan) model, named by the form of their first-loading curve.
MASING_LAWS = ("masing", "table")
# Number of terms of a Taylor series over a step; the remainder is below
# round-off for rates up to 2 per step.
N_TAYLOR_TERMS = 24
NO_YIELD = 1e300  # yield displacement of the unused table entries after the last yield
# Largest displacement [m]; beyond it the steps of the march are too long,
# and the energies would overflow.
MAX_SLIDE = 1e100
N_REPEATED_CYCLES_READ = 3  # number of measured cycles of a repeating motion


class Cases(NamedTuple):
    """Parameters and start of n cases with one mode and one interface: x'' + D x' + W x = P sin - f.

    Times are angles of the drive, and x is the relative displacement [m].

    - `damping`, `stiffness`, `drive` (n,): D, W and P.
    - `kinetic`, `static` (n,): friction force per unit mass in a slip, and its maximum in a stick [m].
    - `spring` (n,): slope of the friction with respect to the slide in a stick, 0 for a rigid contact.
    - `yield_length` (n,): elastic slide at which the interface slips [m].
    - `output_gain`, `base_gain` (n,) [m s-2]: acceleration of the output per x'', and of the base
      per sine.
    - `x`, `v` (n,): slide and speed at the start.
    - `law` (n, k): further numbers of the law. Laws of one stretch: as their `rate_equation` takes
      them. Masing's rule: two numbers of the curve (chi + 1 and q of a power), the fraction of
      `yield_length` at which half of the friction slips, and the table of a curve (`make_curve_tables`).
    """

    damping: np.ndarray
    stiffness: np.ndarray
    drive: np.ndarray
    kinetic: np.ndarray
    static: np.ndarray
    spring: np.ndarray
    yield_length: np.ndarray
    output_gain: np.ndarray
    base_gain: np.ndarray
    x: np.ndarray
    v: np.ndarray
    law: np.ndarray


class LaneResults(NamedTuple):
    """Results of a march of n cases that are integrated in vector lanes (one case per lane).

    - `start`, `observed_start`, `motion` (n, N_STATE and the state of the law): motion at the
      start, at the start of the observed cycles, and at the end.
    - `history` (n, c, 4): smallest and largest slide and phasor [m] of all cycles.
    - `measures` (n, N_MEASURES): measured quantities of the observed cycles.
    - `n_before`, `n_observed` (n,): number of cycles before the observed ones, and of these.
    - `step`: angle of a step [rad].
    """

    start: np.ndarray
    observed_start: np.ndarray
    motion: np.ndarray
    history: np.ndarray
    measures: np.ndarray
    n_before: np.ndarray
    n_observed: np.ndarray
    step: float

    def get_measure(self, name: str) -> np.ndarray:
        """Return the values (n,) of a measure of the observed cycles, given the name of its row."""
        return self.measures[:, Row[name] - rows.FIRST_MEASURE]


def has_one_stretch(law: str) -> bool:
    """Return whether the memory of a friction law is a single stretch.

    The law is then named by the module of its kernels, such as "friction.laws.tanh_kernels".
    """
    return "." in law


@cache
def load_loop(law: str):
    """Load the compiled loop that marches cases with a given friction law.

    The law is "rigid", "yielding", "masing", "table" or the module of the kernels of a law of
    one stretch.
    """
    loop = f"{LANES_PACKAGE}.loop_kernels"
    if law == "rigid":
        return load(loop)
    if has_one_stretch(law):
        kernels = instantiate(f"{LANES_PACKAGE}.flowing_kernels", {"friction": law})
    elif law == "table":
        curve = f"{LANES_PACKAGE}.table_curve_kernels"
        kernels = instantiate(f"{LANES_PACKAGE}.masing_kernels", {"curve": curve})
    else:
        kernels = f"{LANES_PACKAGE}.{law}_kernels"
    parts = {
        "law": kernels,
        "lanes": instantiate(f"{LANES_PACKAGE}.lane_kernels", {"law": kernels}),
    }
    extrapolation = instantiate(f"{LANES_PACKAGE}.extrapolation_kernels", parts)
    observation = instantiate(f"{LANES_PACKAGE}.observation_kernels", parts)
    return instantiate(loop, parts | {"extrapolation": extrapolation, "observation": observation})


def count_law_rows(law: str) -> int:
    """Return the number of workspace rows for the additional variables that a friction law needs."""
    if has_one_stretch(law):
        return len(rows.StretchRow)
    if law in MASING_LAWS:
        n_table_rows = len(rows.TableRow) if law == "table" else 0
        return rows.CURVE_STATE - rows.LAW_STATE + n_table_rows
    return 0


def make_curve_tables(groups) -> np.ndarray:
    """Tabulate the first-loading curves of n sets of Jenkins elements, (n, m).

    Parameters
    ----------
    groups : list of tuple
        Stiffness (t,) [N/m] and increasing yield slides (t,) [m] of each set; t is less than
        `rows_kernels.N_YIELDS`.

    Returns
    -------
    (n, m) array
        Two unused numbers, the fraction of the last yield slide at which half of the friction slips, and the
        table of `table_curve_kernels`.
    """
    heads = np.ones((len(groups), 3))
    tables = np.zeros((len(groups), rows.TABLE_SIZE))
    yields = tables[:, : rows.PART_STARTS].reshape(len(groups), rows.N_YIELDS, rows.N_COLUMNS)
    yields[:, 1:, rows.YieldColumn.YIELD] = NO_YIELD
    yields[:, 0, rows.YieldColumn.SLOPE] = 1.0
    for head, rows_of_table, table, (stiffness, yield_slide) in zip(heads, yields, tables, groups):
        n = len(stiffness)
        w = yield_slide / yield_slide[-1]
        fraction = stiffness / stiffness.sum()
        rows_of_table[1 : n + 1, rows.YieldColumn.YIELD] = w
        for column, values in (
            (rows.YieldColumn.FORCE, fraction * w),
            (rows.YieldColumn.MOMENT, fraction * w * w),
        ):
            after_last = np.zeros(rows.N_YIELDS - 1 - n)
            rows_of_table[1:, column] = np.append(np.cumsum(values), after_last)
        # The slope is the stiffness of the elements that have not yielded,
        # which is 0 after the last yield.
        rows_of_table[1:n, rows.YieldColumn.SLOPE] = np.cumsum(fraction[:0:-1])[::-1]
        half_force = 0.5 * rows_of_table[n, rows.YieldColumn.FORCE]
        head[2] = w[np.searchsorted(rows_of_table[1:n, rows.YieldColumn.FORCE], half_force)]
        edges = np.linspace(w[0], w[-1], rows.N_PARTS + 1)
        starts = slice(rows.PART_STARTS, rows.PART_STARTS + rows.N_PARTS)
        table[starts] = np.searchsorted(w, edges[:-1])
        table[rows.FIRST_YIELD] = w[0]
        table[rows.PARTS_PER_SLIDE] = rows.N_PARTS / max(w[-1] - w[0], 1e-300)
    return np.concatenate([heads, tables], axis=1)


def law_number_scales(law: str, force, omega) -> np.ndarray:
    """Return the factors (n, k) that convert the parameters of a law to the units of the cases.

    Parameters
    ----------
    law : str
    force : (n,) array
        Force of a case [m] per force in N.
    omega : (n,) array
        Angular frequency of the drive [rad/s].

    Returns
    -------
    (n, k) array
    """
    ones = np.ones(np.shape(omega))
    units = {
        "1": ones,
        "m": ones,
        "m/s": ones / omega,
        "s/m": omega,
        "N": force,
        "N/m": force,
        "N_s/m": force * omega,
    }
    return np.stack([units[unit] for unit in load(law).NUMBER_UNITS.split()], axis=-1)


def taylor_step(damping, stiffness, angle: float, start: tuple, forces: tuple) -> tuple:
    """Integrate x'' + D x' + W x = g over a phase angle by Taylor series.

    Parameters
    ----------
    damping, stiffness : (n,) array
    angle : float
        [rad]
    start : tuple of float
        x and x' at the start.
    forces : tuple of float
        Derivatives of g at the start, from order 0 on; those left out are 0.

    Returns
    -------
    (n,) array
        x at the end.
    (n,) array
        x' at the end.
    """
    y = [np.full(damping.shape, float(value)) for value in start]
    x = y[0] + angle * y[1]
    v = y[1]
    power = 1.0
    for k in range(N_TAYLOR_TERMS):
        force = forces[k] if k < len(forces) else 0.0
        y.append(force - damping * y[k + 1] - stiffness * y[k])
        power *= angle / (k + 1)
        x = x + y[k + 2] * power * angle / (k + 2)
        v = v + y[k + 2] * power
    return x, v


def make_case_numbers(law: str, cases: Cases, steps: int) -> np.ndarray:
    """Return the parameters of the cases, in the order of their workspace rows, and their tables.

    The first number belongs in row `rows_kernels.FIRST_NUMBER`.

    Parameters
    ----------
    law : str
    cases : Cases
    steps : int
        Number of steps of a cycle.

    Returns
    -------
    (n, N_NUMBERS + t) array
    """
    n = len(cases.damping)
    table = cases.law[:, 3:] if law == "table" else np.empty((n, 0))
    numbers = np.concatenate([np.zeros((n, rows.N_NUMBERS)), table], axis=1)
    angle = 2 * np.pi / steps
    numbers[:, Row.DAMPING - rows.FIRST_NUMBER : rows.N_NUMBERS] = np.array(cases[:9]).T
    if law not in ("rigid", "yielding"):
        numbers[:, Row.STEP - rows.FIRST_NUMBER] = angle
        numbers[:, Row.MIDPOINT_FACTOR - rows.FIRST_NUMBER] = 0.5 / np.cos(angle / 2)
        first = Row.LAW_NUMBERS - rows.FIRST_NUMBER
        law_numbers = cases.law[:, : rows.N_LAW_NUMBERS]
        numbers[:, first : first + rows.N_LAW_NUMBERS] = 1.0
        numbers[:, first : first + law_numbers.shape[1]] = law_numbers
        return numbers
    for spring, first in ((0.0, Row.A11), (cases.spring, Row.B11)):
        first -= rows.FIRST_NUMBER
        numbers[:, first : first + 10] = step_coefficients(cases, spring, angle)
    return numbers


def step_coefficients(cases: Cases, spring, angle: float) -> np.ndarray:
    """Return the coefficients of an exact time step with a spring in parallel with the mode.

    Parameters
    ----------
    cases : Cases
    spring : (n,) array
        Stiffness of the spring in the unit of `Cases.stiffness`.
    angle : float
        Angle of the step [rad].

    Returns
    -------
    (n, 10) array
        Its columns are named in `rows_kernels`.
    """
    quarters = np.arange(N_TAYLOR_TERMS) * np.pi / 2
    sines = np.round(np.sin(quarters)).tolist()
    cosines = np.round(np.cos(quarters)).tolist()
    stiffness = cases.stiffness + spring

    def respond(start, forces):
        return taylor_step(cases.damping, stiffness, angle, start, forces)

    by_slide = respond((1, 0), ())
    by_speed = respond((0, 1), ())
    by_force = respond((0, 0), (1.0,))
    by_sine = [cases.drive * value for value in respond((0, 0), cosines)]
    by_cosine = [cases.drive * value for value in respond((0, 0), sines)]
    slide, speed = zip(by_slide, by_speed)
    return np.array([*slide, *speed, *by_force, *by_sine, *by_cosine]).T


def make_drive_table(steps: int) -> np.ndarray:
    """Return sine and cosine of the drive phase at the steps of a cycle, and the phase step.

    They are the rows of an array (3, steps + 1).
    """
    angle = 2 * np.pi * np.arange(steps + 1) / steps
    waves = np.array([np.sin(angle), np.cos(angle)])
    # Zeros are set exactly, because cycles would otherwise differ in the last bit.
    waves[np.abs(waves) < 1e-15] = 0.0
    return np.concatenate([waves, np.full((1, steps + 1), 2 * np.pi / steps)])


def initial_motion(law: str, cases: Cases) -> np.ndarray:
    """Return the initial motion of the cases.

    It has the shape (n, N_STATE and the number of law variables).
    """
    motion = np.zeros((len(cases.damping), rows.N_STATE + count_law_rows(law)))
    motion[:, Row.SLIDE] = cases.x
    motion[:, Row.SPEED] = cases.v
    motion[:, Row.MEMORY] = cases.x
    motion[:, Row.SLIP_SIGN] = np.sign(cases.v) * (cases.spring == 0)
    if has_one_stretch(law):
        moving = np.where(cases.v == 0, np.sign(cases.drive), np.sign(cases.v))
        motion[:, Row.SLIP_SIGN] = moving
        motion[:, Row.MEMORY] = 0.0
    if law in MASING_LAWS:
        moving = np.select([cases.v != 0, cases.x != 0], [cases.v, -cases.x], cases.drive)
        direction = np.sign(moving)
        direction[direction == 0] = 1.0
        half_slip = direction * cases.yield_length * cases.law[:, 2]
        for row, value in (
            (rows.SliderRow.DIRECTION, direction),
            (rows.SliderRow.BRANCH_SCALE, 1.0),
            (rows.SliderRow.KEEPS_FIRST_LOADING, 1.0),
            (rows.SliderRow.TURN_SLIDE, cases.x),
            (rows.SliderRow.TANGENT, cases.spring),
            (rows.SliderRow.NEXT_EVENT, cases.x + half_slip),
        ):
            motion[:, row - rows.LAW_STATE + rows.N_STATE] = value
        motion[:, Row.MEMORY] = 0.0
    motion[:, Row.MAX_SLIDE] = cases.x
    motion[:, Row.MIN_SLIDE] = cases.x
    return motion


def law_state(law: str, motion, name: str) -> np.ndarray:
    """Return a state variable (n,) of the friction law in a motion, given the name of its row.

    Parameters
    ----------
    law : str
    motion : array
        Motions of the cases, as `loop_kernels.march` writes them.
    name : str
        Name of a row in `rows_kernels.StretchRow` or `rows_kernels.SliderRow`.

    Returns
    -------
    (n,) array
    """
    law_rows = rows.StretchRow if has_one_stretch(law) else rows.SliderRow
    return motion[:, rows.N_STATE + law_rows[name] - rows.LAW_STATE]


def continue_march(law: str, cases: Cases, motion, cycles: int, steps: int) -> tuple:
    """March cases over further cycles, or until their motion repeats.

    The last cycle then stands for those that follow.

    Parameters
    ----------
    law : str
    cases : Cases
    motion : array
        As `initial_motion` returns it.
    cycles, steps : int
        Number of cycles, and of steps of a cycle.

    Returns
    -------
    history : (n, cycles, 4) array
    motion : array
        Motion at the end.
    """
    n = len(cases.damping)
    history = np.zeros((n, cycles, 4))
    n_done = np.zeros(n, np.int64)
    motion = motion.copy()
    numbers = make_case_numbers(law, cases, steps)
    workspace = make_workspace(numbers, motion)
    load_loop(law).march(
        numbers, np.arange(n), motion, make_drive_table(steps), cycles, history, n_done, *workspace
    )
    repeat_last_cycles(history, n_done)
    return history, motion


def repeat_last_cycles(history, n_done) -> None:
    """Fill the history (n, c, 4) by repeating the last of the `n_done` (n,) cycles computed per case."""
    for case in np.flatnonzero(n_done < history.shape[1]):
        history[case, n_done[case] :] = history[case, n_done[case] - 1]


def output_accelerations(law: str, cases: Cases, motion, cycles: int, steps: int) -> np.ndarray:
    """Return the absolute output acceleration [m s-2] at the start and after each step.

    Parameters
    ----------
    law, cases, motion, cycles, steps
        See `continue_march`.

    Returns
    -------
    (n, cycles * steps + 1) array
    """
    n = len(cases.damping)
    numbers = make_case_numbers(law, cases, steps)
    motion = motion.copy()
    accelerations = np.empty((n, cycles * steps + 1))
    load_loop(law).observe(
        numbers,
        np.arange(n),
        motion,
        make_drive_table(steps),
        cycles,
        np.zeros((n, cycles, 4)),
        np.zeros(n, np.int64),
        np.zeros((n, rows.N_MEASURES)),
        accelerations,
        *make_workspace(numbers, motion),
    )
    return accelerations


def make_workspace(numbers, motion) -> tuple:
    """Return the workspace for a batch of cases in vector lanes, and an array for lane indices."""
    n_law_state = motion.shape[1] - rows.N_STATE
    table_size = numbers.shape[1] - rows.N_NUMBERS
    n_rows = rows.LAW_STATE + n_law_state + table_size
    return np.zeros(n_rows * rows.LANES), np.zeros(rows.LANES + 1, np.int64)


def march(law: str, cases: Cases, cycles: int, window: int, steps: int) -> LaneResults:
    """March cases from their start and measure their last cycles.

    Parameters
    ----------
    law : str
        As `load_loop` names it.
    cases : Cases
    cycles, window : int
        Number of all cycles, and of the last ones that are read; of a motion that repeats fewer are read.
    steps : int
        Number of steps of a cycle.

    Returns
    -------
    LaneResults
        All numbers of a march that ran away are NaN.
    """
    loop = load_loop(law)
    n = len(cases.damping)
    numbers = make_case_numbers(law, cases, steps)
    table = make_drive_table(steps)
    order = np.arange(n)
    start = initial_motion(law, cases)
    motion = start.copy()
    history = np.zeros((n, cycles, 4))
    n_before = np.zeros(n, np.int64)
    measures = np.zeros((n, rows.N_MEASURES))
    workspace = make_workspace(numbers, motion)
    loop.march(numbers, order, motion, table, cycles - window, history, n_before, *workspace)
    observed_start = motion.copy()
    n_observed = np.where(n_before < cycles - window, min(N_REPEATED_CYCLES_READ, window), window)
    for count in np.unique(n_observed).tolist():
        loop.observe(
            numbers,
            order[n_observed == count],
            motion,
            table,
            count,
            history,
            n_before,
            measures,
            np.empty((n, 0)),
            *workspace,
        )
    repeat_last_cycles(history, n_before + n_observed)
    runs_away = ~(np.abs(history[:, :, :2]).max(axis=(1, 2), initial=0.0) < MAX_SLIDE)
    for values in (observed_start, motion, history, measures):
        values[runs_away] = np.nan
    step = 2 * np.pi / steps
    return LaneResults(start, observed_start, motion, history, measures, n_before, n_observed, step)
