"""Energies and measures of cases integrated in batches, in the format of `dynamics.events`.

Sums of a march are those of the trapezoidal rule; the formula of Euler and Maclaurin corrects them at their ends.
"""

from typing import NamedTuple

import numpy as np

from ..events.positions_kernels import InterfaceMeasure, RunMeasure
from ..events.reading import Reading
from . import rows_kernels as rows
from .rows_kernels import Row
from .run import MASING_LAWS, Cases, LaneResults, has_one_stretch, law_state

# Measures of an interface in `dynamics.events`, the corresponding measures of the lanes, and their
# units; lanes use m instead of N, and drive angles instead of times.
INTERFACE_MEASURES = (
    (InterfaceMeasure.MAX_SLIP, "MAX_SLIP", "m"),
    (InterfaceMeasure.MIN_SLIP, "MIN_SLIP", "m"),
    (InterfaceMeasure.MEAN_RANGE, "MEAN_RANGE", "m"),
    (InterfaceMeasure.MAX_FORCE, "MAX_FORCE", "N"),
    (InterfaceMeasure.END_WORK, "LOOP_WORK", "N m"),
    (InterfaceMeasure.PATH_WORK, "LOOP_WORK_SIZE", "N m"),
    (InterfaceMeasure.STUCK_TIME, "STICK_ANGLE", "s"),
    (InterfaceMeasure.FIRST_SLIDE, "FIRST_MEAN_SLIDE", "m s"),
    (InterfaceMeasure.LAST_SLIDE, "LAST_MEAN_SLIDE", "m s"),
    (InterfaceMeasure.FIRST_FORCE, "FIRST_MEAN_FORCE", "N s"),
    (InterfaceMeasure.LAST_FORCE, "LAST_MEAN_FORCE", "N s"),
)
RUN_MEASURES = (
    (RunMeasure.MAX_ACCELERATION, "MAX_ACCELERATION"),
    (RunMeasure.N_RELEASES, "SLIP_STARTS"),
    (RunMeasure.RELEASE_COS, "START_COS"),
    (RunMeasure.RELEASE_SIN, "START_SIN"),
)


class Integrals(NamedTuple):
    """Integrals (n,) of a quantity times cosine and sine of the drive phase over the observed cycles."""

    cosine: np.ndarray
    sine: np.ndarray


class Harmonics(NamedTuple):
    """Integrals of displacement, output acceleration and friction at the drive frequency.

    The integrals of the output acceleration at three times the drive frequency are included.
    """

    slide: Integrals
    acceleration: Integrals
    friction: Integrals
    third_acceleration: Integrals


def run_energies(law: str, cases: Cases, marched: LaneResults, energy) -> dict:
    """Return the energies (n,) [J] of complete runs as a dictionary.

    Parameters
    ----------
    law : str
        As `run.load_loop` names it.
    cases : Cases
    marched : LaneResults
    energy : (n,) array
        Energy per square of a length [kg s-2].

    Returns
    -------
    dict
        The sums over cycles that repeat are those of the observed cycles.
    """
    step = marched.step
    observed_start = marched.observed_start
    end = marched.motion
    n_repeated = marched.history.shape[1] - marched.n_before - marched.n_observed
    sums = {}
    for row in rows.SUM_ROWS:
        growth = (end[:, row] - observed_start[:, row]) / marched.n_observed
        sums[row] = end[:, row] + n_repeated * growth
    x0 = marched.start[:, Row.SLIDE]
    v0 = marched.start[:, Row.SPEED]
    x1 = end[:, Row.SLIDE]
    v1 = end[:, Row.SPEED]
    rate0 = v0 * _free_acceleration(law, cases, marched.start)
    rate1 = v1 * _free_acceleration(law, cases, end)
    loss_ends = step / 2 * (v0**2 - v1**2) + step * step / 6 * (rate0 - rate1)
    work_ends = step * step / 12 * (v0 - v1)
    largest = np.abs(marched.history[:, :, :2]).max(axis=(1, 2))
    elastic = _elastic_energy(law, cases, end) - _elastic_energy(law, cases, marched.start)
    if has_one_stretch(law):
        dissipated = sums[Row.SLIP_PATH] - elastic
    else:
        dissipated = cases.kinetic * sums[Row.SLIP_PATH]
    stored = v1**2 - v0**2 + cases.stiffness * (x1**2 - x0**2)
    peak_stored = np.maximum(cases.stiffness * largest**2, v0**2 + cases.stiffness * x0**2)
    energies = {
        "work_in": cases.drive * (step * sums[Row.WORK_SUM] + work_ends),
        "viscous": cases.damping * (step * sums[Row.LOSS_SUM] + loss_ends),
        "power": np.abs(cases.drive) * step * sums[Row.POWER_SUM],
        "friction": dissipated + elastic,
        "lost": dissipated,
        "stored": 0.5 * stored,
        "peak_stored": 0.5 * peak_stored,
    }
    return {name: energy * value for name, value in energies.items()}


def _free_acceleration(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the acceleration (n,) of the relative displacement at drive phase 0."""
    x = motion[:, Row.SLIDE]
    v = motion[:, Row.SPEED]
    return -cases.damping * v - cases.stiffness * x - _friction(law, cases, motion)


def _friction(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the friction force per unit mass (n,) [m] at drive phase 0."""
    x = motion[:, Row.SLIDE]
    memory = motion[:, Row.MEMORY]
    slip_sign = motion[:, Row.SLIP_SIGN]
    if law in MASING_LAWS:
        return memory
    if has_one_stretch(law):
        return law_state(law, motion, "FRICTION")
    stick_force = -cases.stiffness * x if law == "rigid" else cases.spring * (x - memory)
    return np.where(slip_sign != 0, slip_sign * cases.kinetic, stick_force)


def _elastic_energy(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the elastic energy (n,) [m^2] of the interface per unit mass."""
    if law in MASING_LAWS:
        return _slider_energy(law, cases, motion)
    if has_one_stretch(law):
        square = law_state(law, motion, "STRETCH_SQUARE")
    else:
        square = (motion[:, Row.SLIDE] - motion[:, Row.MEMORY]) ** 2
    return 0.5 * cases.spring * square


def _slider_energy(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the elastic energy (n,) [m^2] per unit mass in the sliders of the Masing (Iwan) model.

    It is computed as in `masing_kernels.slider_energy`.
    """
    side = law_state(law, motion, "DIRECTION")
    m = law_state(law, motion, "BRANCH_SCALE")
    turn_force = law_state(law, motion, "TURN_FORCE")
    length = cases.yield_length
    distance = side * (motion[:, Row.SLIDE] - law_state(law, motion, "TURN_SLIDE")) / m
    w = np.minimum(distance / length, 1.0)
    force = side * (motion[:, Row.MEMORY] - turn_force) / m / (cases.spring * length)
    if law == "masing":
        exponent = cases.law[:, 0]
        work = w * (w / 2 - (w - force) / (exponent + 2))
        slip = exponent / (exponent + 2) * w * (w - force)
    else:
        table = cases.law[:, 3 : 3 + rows.PART_STARTS]
        table = table.reshape(len(w), rows.N_YIELDS, rows.N_COLUMNS)
        last = np.sum(table[:, 1:, rows.YieldColumn.YIELD] <= w[:, None], axis=1)
        row = table[np.arange(len(w)), last]
        work = (w * (force + row[:, rows.YieldColumn.FORCE]) - row[:, rows.YieldColumn.MOMENT]) / 2
        slip = row[:, rows.YieldColumn.FORCE] * w - row[:, rows.YieldColumn.MOMENT]
    beyond = cases.kinetic * (distance - w * length)
    work = cases.spring * length**2 * work + beyond
    slip_loss = cases.spring * length**2 * slip + beyond
    branch = side * turn_force * distance + m * work - slip_loss
    return law_state(law, motion, "TURN_ENERGY") + m * branch


def measure_runs(law: str, cases: Cases, marched: LaneResults, energy, omega, extremes) -> Reading:
    """Return the measures of the observed cycles for n runs.

    Parameters
    ----------
    law, cases, marched, energy
        See `run_energies`.
    omega : (n,) array
        Angular frequency of the drive [rad/s].
    extremes : (n, c, 2) array
        Extremes of the output in the cycles of the window [m].

    Returns
    -------
    Reading
    """
    n = len(omega)
    start = marched.observed_start
    end = marched.motion
    run = np.zeros((n, len(RunMeasure)))
    face = np.zeros((n, len(InterfaceMeasure)))
    angle = 2 * np.pi * marched.n_observed
    harmonics = integrate_harmonics(law, cases, marched, angle)
    run[:, RunMeasure.MIN_OUTPUT] = extremes[:, :, 0].min(axis=1)
    run[:, RunMeasure.MAX_OUTPUT] = extremes[:, :, 1].max(axis=1)
    run[:, RunMeasure.MAX_COORDINATE] = np.abs(extremes).max(axis=(1, 2))
    accelerations = np.array([*harmonics.acceleration, *harmonics.third_acceleration])
    run[:, [RunMeasure.COS_1, RunMeasure.SIN_1, RunMeasure.COS_3, RunMeasure.SIN_3]] = (
        accelerations.T / omega[:, None]
    )
    for column, name in RUN_MEASURES:
        run[:, column] = marched.get_measure(name)
    last = marched.history[:, -extremes.shape[1] :]
    face[:, InterfaceMeasure.MIN_SLIDE] = last[..., 0].min(axis=1)
    face[:, InterfaceMeasure.MAX_SLIDE] = last[..., 1].max(axis=1)
    for column, name, unit in INTERFACE_MEASURES:
        scale = energy if "N" in unit else 1.0
        face[:, column] = (scale / omega if "s" in unit else scale) * marched.get_measure(name)
    path = end[:, Row.SLIP_PATH] - start[:, Row.SLIP_PATH]
    if has_one_stretch(law):
        work = path
    else:
        elastic = _elastic_energy(law, cases, end) - _elastic_energy(law, cases, start)
        work = cases.kinetic * path + elastic
    face[:, InterfaceMeasure.WORK] = energy * work
    face[:, [InterfaceMeasure.SLIDE_COS, InterfaceMeasure.SLIDE_SIN]] = (
        np.array(harmonics.slide).T / omega[:, None]
    )
    face[:, [InterfaceMeasure.FORCE_COS, InterfaceMeasure.FORCE_SIN]] = (
        np.array(harmonics.friction).T * (energy / omega)[:, None]
    )
    face[:, InterfaceMeasure.START_SLIDE] = start[:, Row.SLIDE]
    face[:, InterfaceMeasure.END_SLIDE] = end[:, Row.SLIDE]
    n_secants = marched.get_measure("N_SECANTS")
    secant = marched.get_measure("SECANT_SUM") / np.where(n_secants > 0, n_secants, 1.0)
    face[:, InterfaceMeasure.SECANT] = np.where(n_secants > 0, energy * secant, np.nan)
    return Reading(run, face[:, None], angle / omega, 2 * np.pi / omega)


def integrate_harmonics(law: str, cases: Cases, marched: LaneResults, angle) -> Harmonics:
    """Integrate displacement, acceleration and friction times cosine and sine of the drive phase.

    The integrals of x'' follow from those of x by parts, and those of the friction from the equation. The sums of x are
    corrected at their ends to the sixth order, or to the fourth for a law of one stretch.

    Parameters
    ----------
    law, cases, marched
        See `run_energies`.
    angle : (n,) array
        Angle of the observed cycles [rad].

    Returns
    -------
    Harmonics
    """
    step = marched.step
    start = marched.observed_start
    end = marched.motion
    x = start[:, Row.SLIDE] - end[:, Row.SLIDE]
    v = start[:, Row.SPEED] - end[:, Row.SPEED]
    a, j = _end_differences(law, cases, start, end)
    second = step * step / 12
    fourth = step**4 / 720
    trapezoid = step / 2 * x + second * v
    cosine = step * marched.get_measure("COS_1") + trapezoid - fourth * (j - 3 * v)
    cosine3 = step * marched.get_measure("COS_3") + trapezoid - fourth * (j - 27 * v)
    sine = step * marched.get_measure("SIN_1") + second * x - fourth * (3 * a - x)
    sine3 = step * marched.get_measure("SIN_3") + 3 * second * x - fourth * (9 * a - 27 * x)
    by_cosine = -v - cosine
    by_sine = x - sine
    acceleration = Integrals(
        cases.output_gain * by_cosine, cases.output_gain * by_sine + cases.base_gain * angle / 2
    )
    friction = Integrals(
        -by_cosine - cases.damping * (sine - x) - cases.stiffness * cosine,
        cases.drive * angle / 2 - by_sine + cases.damping * cosine - cases.stiffness * sine,
    )
    third = Integrals(
        cases.output_gain * (-v - 9 * cosine3), cases.output_gain * (3 * x - 9 * sine3)
    )
    return Harmonics(Integrals(cosine, sine), acceleration, friction, third)


def _end_differences(law: str, cases: Cases, start, end) -> tuple:
    """Return the differences (n,) of x'' and x''' between two motions at drive phase 0.

    The friction of a law of one stretch is taken as constant, because its steps are finer.
    """
    x = start[:, Row.SLIDE] - end[:, Row.SLIDE]
    v = start[:, Row.SPEED] - end[:, Row.SPEED]
    a = -cases.damping * v - cases.stiffness * x
    if has_one_stretch(law):
        return a, 0 * v
    a = a - _friction(law, cases, start) + _friction(law, cases, end)
    rate = _friction_rate(law, cases, start) - _friction_rate(law, cases, end)
    return a, -cases.damping * a - cases.stiffness * v - rate


def _friction_rate(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the derivative (n,) of the friction force per unit mass by the drive phase."""
    if law in MASING_LAWS:
        tangent = law_state(law, motion, "TANGENT")
    else:
        tangent = cases.spring * (motion[:, Row.SLIP_SIGN] == 0)
    return motion[:, Row.SPEED] * tangent
