"""Energies and readings of a march in lanes, in the form of those of `dynamics.events`.

Sums of a march are those of the trapezoidal rule; the formula of Euler and Maclaurin corrects them at their ends.
"""

from typing import NamedTuple

import numpy as np

from ..events.positions_kernels import INTERFACE, RUN
from ..events.reading import Reading
from . import rows_kernels as rows
from .run import MASING, Cases, Marched, has_one_stretch, law_kernels, law_state

# Readings of the interface of `dynamics.events` and of the lanes, with the power of the energy and of the frequency by
# which a lane's reading is multiplied.
INTERFACE_READINGS = (
    (INTERFACE.max_slip, "MAX_SLIP", 0, 0),
    (INTERFACE.min_slip, "MIN_SLIP", 0, 0),
    (INTERFACE.mean_range, "MEAN_RANGE", 0, 0),
    (INTERFACE.max_force, "MAX_FORCE", 1, 0),
    (INTERFACE.end_work, "LOOP_WORK", 1, 0),
    (INTERFACE.path_work, "LOOP_WORK_SIZE", 1, 0),
    (INTERFACE.stuck_time, "STICK_ANGLE", 0, -1),
    (INTERFACE.first_slide, "FIRST_MEAN_SLIDE", 0, -1),
    (INTERFACE.last_slide, "LAST_MEAN_SLIDE", 0, -1),
    (INTERFACE.first_force, "FIRST_MEAN_FORCE", 1, -1),
    (INTERFACE.last_force, "LAST_MEAN_FORCE", 1, -1),
)
RUN_READINGS = (
    (RUN.max_acceleration, "MAX_ACCELERATION"),
    (RUN.n_releases, "SLIP_STARTS"),
    (RUN.release_cos, "START_COS"),
    (RUN.release_sin, "START_SIN"),
)


class Integrals(NamedTuple):
    """Integrals (n,) over the observed cycles with the cosine and the sine of the drive."""

    cosine: np.ndarray
    sine: np.ndarray


class Harmonics(NamedTuple):
    """Integrals of the slide, of the acceleration of the output, of the friction, and of the acceleration at 3 times."""

    slide: Integrals
    acceleration: Integrals
    friction: Integrals
    third_acceleration: Integrals


def run_energies(law: str, cases: Cases, marched: Marched, energy) -> dict:
    """Return the energies (n,) [J] of whole runs by name.

    Parameters
    ----------
    law : str
        As `run.load_loop` names it.
    cases : Cases
    marched : Marched
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
    x0 = marched.start[:, rows.SLIDE]
    v0 = marched.start[:, rows.SPEED]
    x1 = end[:, rows.SLIDE]
    v1 = end[:, rows.SPEED]
    rate0 = v0 * _free_acceleration(law, cases, marched.start)
    rate1 = v1 * _free_acceleration(law, cases, end)
    loss_ends = step / 2 * (v0**2 - v1**2) + step * step / 6 * (rate0 - rate1)
    work_ends = step * step / 12 * (v0 - v1)
    largest = np.abs(marched.history[:, :, :2]).max(axis=(1, 2))
    elastic = _elastic_energy(law, cases, end) - _elastic_energy(law, cases, marched.start)
    if has_one_stretch(law):
        dissipated = sums[rows.SLIP_PATH] - elastic
    else:
        dissipated = cases.kinetic * sums[rows.SLIP_PATH]
    stored = v1**2 - v0**2 + cases.stiffness * (x1**2 - x0**2)
    peak_stored = np.maximum(cases.stiffness * largest**2, v0**2 + cases.stiffness * x0**2)
    energies = {
        "work_in": cases.drive * (step * sums[rows.WORK_SUM] + work_ends),
        "viscous": cases.damping * (step * sums[rows.LOSS_SUM] + loss_ends),
        "power": np.abs(cases.drive) * step * sums[rows.POWER_SUM],
        "friction": dissipated + elastic,
        "lost": dissipated,
        "stored": 0.5 * stored,
        "peak_stored": 0.5 * peak_stored,
    }
    return {name: energy * value for name, value in energies.items()}


def _free_acceleration(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the acceleration (n,) of a motion where the drive passes 0."""
    x = motion[:, rows.SLIDE]
    v = motion[:, rows.SPEED]
    return -cases.damping * v - cases.stiffness * x - _friction(law, cases, motion)


def _friction(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the friction over the mass (n,) [m] of a motion where the drive passes 0."""
    x = motion[:, rows.SLIDE]
    memory = motion[:, rows.MEMORY]
    slip_sign = motion[:, rows.SLIP_SIGN]
    if law in MASING:
        return memory
    if has_one_stretch(law):
        return law_state(law, motion, "FRICTION")
    stick_force = -cases.stiffness * x if law == "rigid" else cases.spring * (x - memory)
    return np.where(slip_sign != 0, slip_sign * cases.kinetic, stick_force)


def _elastic_energy(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the elastic energy (n,) of the interface over the mass [m^2]."""
    if law in MASING:
        return _slider_energy(law, cases, motion)
    if has_one_stretch(law):
        square = law_state(law, motion, "STRETCH_SQUARE")
    else:
        square = (motion[:, rows.SLIDE] - motion[:, rows.MEMORY]) ** 2
    return 0.5 * cases.spring * square


def _slider_energy(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the elastic energy (n,) of the sliders of Masing's rule, as `masing_kernels.slider_energy` computes it."""
    side = law_state(law, motion, "DIRECTION")
    m = law_state(law, motion, "BRANCH_SCALE")
    turn_force = law_state(law, motion, "TURN_FORCE")
    length = cases.yield_length
    distance = side * (motion[:, rows.SLIDE] - law_state(law, motion, "TURN_SLIDE")) / m
    w = np.minimum(distance / length, 1.0)
    force = side * (motion[:, rows.MEMORY] - turn_force) / m / (cases.spring * length)
    if law == "masing":
        exponent = cases.law[:, 0]
        work = w * (w / 2 - (w - force) / (exponent + 2))
        slip = exponent / (exponent + 2) * w * (w - force)
    else:
        curve = law_kernels(law).curve
        table = cases.law[:, 3 : 3 + curve.PART_STARTS]
        table = table.reshape(len(w), curve.N_YIELDS, curve.N_COLUMNS)
        last = np.sum(table[:, 1:, curve.YIELD] <= w[:, None], axis=1)
        row = table[np.arange(len(w)), last]
        work = (w * (force + row[:, curve.FORCE]) - row[:, curve.MOMENT]) / 2
        slip = row[:, curve.FORCE] * w - row[:, curve.MOMENT]
    beyond = cases.kinetic * (distance - w * length)
    work = cases.spring * length**2 * work + beyond
    slip_loss = cases.spring * length**2 * slip + beyond
    branch = side * turn_force * distance + m * work - slip_loss
    return law_state(law, motion, "TURN_ENERGY") + m * branch


def reading_of_runs(law: str, cases: Cases, marched: Marched, energy, omega, extremes) -> Reading:
    """Return the `Reading` of the observed cycles of n runs.

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
    run = np.zeros((n, len(RUN)))
    face = np.zeros((n, len(INTERFACE)))
    angle = 2 * np.pi * marched.n_observed
    harmonics = integrate_harmonics(law, cases, marched, angle)
    run[:, RUN.min_output] = extremes[:, :, 0].min(axis=1)
    run[:, RUN.max_output] = extremes[:, :, 1].max(axis=1)
    run[:, RUN.max_coordinate] = np.abs(extremes).max(axis=(1, 2))
    accelerations = np.array([*harmonics.acceleration, *harmonics.third_acceleration])
    run[:, [RUN.cos_1, RUN.sin_1, RUN.cos_3, RUN.sin_3]] = accelerations.T / omega[:, None]
    for column, name in RUN_READINGS:
        run[:, column] = marched.reading(name)
    last = marched.history[:, -extremes.shape[1] :]
    face[:, INTERFACE.min_slide] = last[..., 0].min(axis=1)
    face[:, INTERFACE.max_slide] = last[..., 1].max(axis=1)
    for column, name, energy_power, frequency_power in INTERFACE_READINGS:
        unit = energy**energy_power * omega ** float(frequency_power)
        face[:, column] = unit * marched.reading(name)
    path = end[:, rows.SLIP_PATH] - start[:, rows.SLIP_PATH]
    if has_one_stretch(law):
        work = path
    else:
        elastic = _elastic_energy(law, cases, end) - _elastic_energy(law, cases, start)
        work = cases.kinetic * path + elastic
    face[:, INTERFACE.work] = energy * work
    face[:, [INTERFACE.slide_cos, INTERFACE.slide_sin]] = (
        np.array(harmonics.slide).T / omega[:, None]
    )
    face[:, [INTERFACE.force_cos, INTERFACE.force_sin]] = (
        np.array(harmonics.friction).T * (energy / omega)[:, None]
    )
    face[:, INTERFACE.start_slide] = start[:, rows.SLIDE]
    face[:, INTERFACE.end_slide] = end[:, rows.SLIDE]
    n_secants = marched.reading("N_SECANTS")
    secant = marched.reading("SECANT_SUM") / np.where(n_secants > 0, n_secants, 1.0)
    face[:, INTERFACE.secant] = np.where(n_secants > 0, energy * secant, np.nan)
    return Reading(run, face[:, None], angle / omega, 2 * np.pi / omega)


def integrate_harmonics(law: str, cases: Cases, marched: Marched, angle) -> Harmonics:
    """Return integrals over the observed cycles with the cosine and the sine of the drive.

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
    x = start[:, rows.SLIDE] - end[:, rows.SLIDE]
    v = start[:, rows.SPEED] - end[:, rows.SPEED]
    a, j = _end_differences(law, cases, start, end)
    second = step * step / 12
    fourth = step**4 / 720
    trapezoid = step / 2 * x + second * v
    cosine = step * marched.reading("COS_1") + trapezoid - fourth * (j - 3 * v)
    cosine3 = step * marched.reading("COS_3") + trapezoid - fourth * (j - 27 * v)
    sine = step * marched.reading("SIN_1") + second * x - fourth * (3 * a - x)
    sine3 = step * marched.reading("SIN_3") + 3 * second * x - fourth * (9 * a - 27 * x)
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
    """Return the differences (n,) of x'' and of x''' between two motions where the drive passes 0.

    The friction of a law of one stretch is taken as constant, because its steps are finer.
    """
    x = start[:, rows.SLIDE] - end[:, rows.SLIDE]
    v = start[:, rows.SPEED] - end[:, rows.SPEED]
    a = -cases.damping * v - cases.stiffness * x
    if has_one_stretch(law):
        return a, 0 * v
    a = a - _friction(law, cases, start) + _friction(law, cases, end)
    rate = _friction_rate(law, cases, start) - _friction_rate(law, cases, end)
    return a, -cases.damping * a - cases.stiffness * v - rate


def _friction_rate(law: str, cases: Cases, motion) -> np.ndarray:
    """Return the rate of the friction (n,) of a motion."""
    if law in MASING:
        tangent = law_state(law, motion, "TANGENT")
    else:
        tangent = cases.spring * (motion[:, rows.SLIP_SIGN] == 0)
    return motion[:, rows.SPEED] * tangent
