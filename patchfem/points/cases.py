"""Sweeps over cases of one mode and one contact point: measures with errors from half of the steps.

A case starts with few steps per cycle, which are doubled until its measures meet the tolerance. Cases that miss it with
the largest number are listed, so that another engine can compute them.
"""

from typing import NamedTuple

import numpy as np

from .. import compiled
from ..core import ModalBasis, SineDrive
from .case_kernels import LEVELS, TICKS
from .case_rows import Cases, Now, Number, Seen
from .laws import PointLaw
from .return_maps_kernels import Law

STEPS = (64, 128, 256, 512, 1024)  # steps per cycle
SAFETY = 3.0  # error / change from half of the steps: grid convergence index 3/(2 - 1) of order 1
# Fraction of the tolerance that two runs do not show, because both place a reversal or a corner of the law alike
FLOOR_FRACTION = 0.1
# Error in steps of measures that are resolved only to a sample
SAMPLE_ERRORS = {"stick_fraction": 0.5, "slip_start_phase": 2 * np.pi}
FULL_STICK = 1e-12  # fraction of the time below which slip is round-off
MIN_ALIGNMENT = 0.95  # resultant of the phases of slip starts below which they have no common phase
MIN_ACCELERATION = 1e-9  # first harmonic [m s-2] below which it has no distortion
PHASE = "slip_start_phase"
MAIN = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "loop_area",
    "friction_force_peak",
)


class CaseRuns(NamedTuple):
    """Results of c cases.

    - values, errors: measures (c,) by name; NaN where a case does not have the measure
    - extremes (c, n, 2), phasors (c, n): of the output in every cycle [m]
    - steps (c,): steps per cycle
    - missed: numbers of the cases with an error above the tolerance
    """

    values: dict
    errors: dict
    extremes: np.ndarray
    phasors: np.ndarray
    steps: np.ndarray
    missed: np.ndarray


class CaseMarch(NamedTuple):
    """Values by name, and history (c, n, 4) of the cycles of some cases."""

    values: dict
    history: np.ndarray


def make_case(
    modes: ModalBasis, drive: SineDrive, law: PointLaw, cycles: int, *,
    start=None, reference: float = 0.0, window: int | None = None,
) -> Cases:  # fmt: skip
    """Return a batch of one case from the records of a rig.

    Parameters
    ----------
    modes : ModalBasis
        Of one mode that moves the contact.
    drive : SineDrive
    law : PointLaw
        Law of the contact with its load.
    cycles, window : int
        Number of cycles, and of the last of them that are measured: ten, or a tenth of the run where that is shorter.
    start : core.InitialState, optional
    reference : float
        Stiffness of the first mode at the contact [N/m].
    """
    slide, output = modes.slide[0], modes.output[0]
    parameters = np.zeros((1, len(Number)))
    parameters[0] = (
        modes.damping_matrix[0, 0], modes.omega[0] ** 2, -slide * modes.base[0] * drive.acceleration,
        slide**2 / modes.mass, drive.omega, law.load, output / slide, drive.acceleration * drive.moving,
        slide * (start.z[0] if start is not None else 0.0), slide * (start.v[0] if start is not None else 0.0),
        cycles, window or max(1, min(10, int(cycles) // 10)),
    )  # fmt: skip
    return Cases(parameters, law.numbers[:, None], law.memory[:, None], np.array([reference]))


def stack_cases(cases) -> Cases:
    """Return several batches with the same law and number of cycles as one."""
    return Cases(
        np.concatenate([one.parameters for one in cases]),
        np.ascontiguousarray(np.concatenate([one.numbers for one in cases], axis=1)),
        np.ascontiguousarray(np.concatenate([one.memory for one in cases], axis=1)),
        np.concatenate([one.reference for one in cases]),
    )


def run_cases(cases: Cases, tolerance: float, steps=STEPS) -> CaseRuns:
    """Run cases with as many steps as the tolerance of their main measures needs.

    Parameters
    ----------
    cases : Cases
        With the same number of cycles.
    tolerance : float
        Largest relative error.
    steps : sequence of int
        Steps per cycle, each twice the one before.
    """
    n = len(cases.parameters)
    left = np.arange(n)
    coarse = march_with(cases, steps[0] // 2)
    coarser = march_with(cases, steps[0] // 4).values
    used = np.zeros(n, int)
    results: dict = {}
    for count in steps:
        part = cases.select(left)
        fine = march_with(part, count)
        errors = estimate_errors((fine.values, coarse.values, coarser), count, tolerance)
        is_met = np.ones(left.size, bool)
        size = fine.values["friction_force_peak"] * fine.values["relative_displacement_amplitude"]
        for name in MAIN:
            # The loop area is a difference of terms of the size force times amplitude.
            larger = np.abs(fine.values[name]) + (size if name == "loop_area" else 0.0)
            with np.errstate(invalid="ignore"):
                is_met &= errors[name] <= tolerance * larger
        rows = {f"value {name}": value for name, value in fine.values.items()}
        rows |= {f"error {name}": error for name, error in errors.items()} | {
            "history": fine.history
        }
        for name, row in rows.items():
            results.setdefault(name, np.full((n, *row.shape[1:]), np.nan))[left] = row
        used[left] = count
        left = left[~is_met]
        if not left.size:
            break
        coarser = {name: value[~is_met] for name, value in coarse.values.items()}
        coarse = CaseMarch(
            {name: value[~is_met] for name, value in fine.values.items()}, fine.history[:0]
        )
    output = cases.parameters[:, Number.OUTPUT, None, None]
    extremes = np.sort(results["history"][..., :2] * output, axis=-1)
    phasors = (results["history"][..., 2] - 1j * results["history"][..., 3]) * output[..., 0]
    return CaseRuns(
        {name[6:]: row for name, row in results.items() if name.startswith("value ")},
        {name[6:]: row for name, row in results.items() if name.startswith("error ")},
        extremes,
        phasors * cases.parameters[:, Number.OMEGA, None] / np.pi,
        used,
        left,
    )


def estimate_errors(runs, steps: int, tolerance: float) -> dict:
    """Return the errors (c,) of measures by name.

    Parameters
    ----------
    runs : sequence of dict
        Measures (c,) by name with `steps` steps per cycle, with half and with a quarter of them. The last change counts
        as at least a quarter of the one before, so that a change that is small by accident gives no small error.
    steps : int
    tolerance : float
        Relative tolerance.
    """
    values = runs[0]
    errors = {}
    for name, value in values.items():
        changes = np.array([value - runs[1][name], runs[1][name] - runs[2][name]])
        if name == PHASE:
            changes = (changes + np.pi / 2) % np.pi - np.pi / 2
        change = np.fmax(np.abs(changes[0]), np.abs(changes[1]) / 4)
        # A measure that only one of the two finest runs has shows an event that the other missed.
        change = np.where(np.isnan(changes[0]), np.nan, change)
        errors[name] = SAFETY * change + FLOOR_FRACTION * tolerance * np.abs(value)
        errors[name] += SAMPLE_ERRORS.get(name, 0.0) / steps
    # These measures are errors themselves.
    for name in ("energy_balance", "work_check"):
        errors[name] = np.maximum(errors[name], values[name])
    return errors


def march_with(cases: Cases, steps: int) -> CaseMarch:
    """Run cases with a number of steps per cycle, and compute their measures."""
    n = len(cases.parameters)
    phase = (
        np.pi / steps * np.concatenate([np.arange(2 * steps + 1), np.arange(2 * TICKS + 1) / TICKS])
    )
    now = np.zeros((n, len(Now)))
    seen = np.zeros((n, len(Seen)))
    history = np.zeros((n, int(cases.parameters[:, Number.CYCLES].max(initial=0)), 4))
    compiled.load("points.case_kernels").march_cases(
        steps, np.array([np.sin(phase), np.cos(phase)]), cases.parameters, cases.numbers,
        cases.memory.copy(), now, seen, history, np.zeros((LEVELS + 1, 2, 5)),
    )  # fmt: skip
    with np.errstate(all="ignore"):
        return CaseMarch(compute_measures(cases, now, seen, history), history)


def compute_measures(cases: Cases, now, seen, history) -> dict:
    """Return the measures (c,) of a sweep row by name.

    Parameters
    ----------
    cases : Cases
    now : (c, 17), seen : (c, 30), history : (c, n, 4) array
        State at the end and observations, see `case_rows`.
    """
    columns = cases.parameters.T
    omega, ratio = columns[Number.OMEGA], columns[Number.OUTPUT]
    mass = 1 / columns[Number.MOBILITY]
    count = seen[:, Seen.N_CYCLES]
    span = seen[:, Seen.SPAN]
    window = int(columns[Number.WINDOW].max(initial=1))
    low = history[:, -window:, 0].min(axis=1)
    high = history[:, -window:, 1].max(axis=1)
    work = seen[:, Seen.WORK]
    stuck = seen[:, Seen.STUCK] / span
    energies = _compute_energies(cases, now, mass)
    values = {
        "relative_displacement_amplitude": (high - low) / 2 * np.abs(ratio),
        "absolute_acceleration_peak": seen[:, Seen.MAX_ACCELERATION],
        "friction_force_peak": seen[:, Seen.MAX_FORCE],
        "slip_amplitude": (seen[:, Seen.MAX_SLIP] - seen[:, Seen.MIN_SLIP]) / 2,
        "stick_fraction": np.where(stuck > 1 - FULL_STICK, 1.0, stuck),
        PHASE: _mean_phase(seen),
        "normal_load": columns[Number.LOAD],
        "loop_area": work / count,
        "drift_per_cycle": (seen[:, Seen.LAST_MEAN] - seen[:, Seen.FIRST_MEAN])
        * omega / (2 * np.pi) / np.maximum(count - 1, 1),
        "work_check": np.abs(seen[:, Seen.SAMPLED] - work)
        / (seen[:, Seen.PASSED] + mass * (now[:, Now.POWER] + now[:, Now.STORED])),
    }  # fmt: skip
    return values | energies | _compute_harmonics(cases, now, seen, values["loop_area"], high - low)


def _compute_energies(cases: Cases, now, mass) -> dict:
    """Return the energies [J] of the whole run and the relative error of their balance."""
    columns = cases.parameters.T
    stored = 0.5 * (now[:, Now.VELOCITY] ** 2 + columns[Number.STIFFNESS] * now[:, Now.SLIDE] ** 2)
    first = 0.5 * (
        columns[Number.VELOCITY] ** 2 + columns[Number.STIFFNESS] * columns[Number.SLIDE] ** 2
    )
    gap = now[:, Now.WORK_IN] + first - stored - now[:, Now.VISCOUS] - now[:, Now.FRICTION]
    size = now[:, Now.POWER] + now[:, Now.STORED]
    elastic = _stored_in_law(cases, now)
    work = mass * now[:, Now.FRICTION]
    return {
        "energy_balance": np.divide(np.abs(gap), size, out=np.zeros_like(gap), where=size > 0),
        "friction_work": work,
        "energy_stored": elastic,
        "energy_dissipated": work - elastic,
        "energy_created": np.zeros_like(work),
    }


def _stored_in_law(cases: Cases, now) -> np.ndarray:
    """Return the elastic energy (c,) [J] of the law at the end: half of force times stretch."""
    stretch = now[:, Now.SLIDE] - now[:, Now.SLIP]
    rigid = cases.numbers[0] == Law.COULOMB
    return np.where(rigid, 0.0, 0.5 * now[:, Now.FORCE] * stretch)


def _mean_phase(seen) -> np.ndarray:
    """Return the mean phase (c,) [rad], modulo pi, at which slip starts; NaN without a common phase."""
    count = seen[:, Seen.STARTS]
    cosine, sine = seen[:, Seen.START_COS], seen[:, Seen.START_SIN]
    is_common = (count > 0) & (np.hypot(cosine, sine) >= MIN_ALIGNMENT * count)
    return np.where(is_common, np.arctan2(sine, cosine) / 2 % np.pi, np.nan)


def _compute_harmonics(cases: Cases, now, seen, area, slide_range) -> dict:
    """Return the measures that follow from harmonics; integrals by parts give those of velocity and acceleration."""
    columns = cases.parameters.T
    omega, span = columns[Number.OMEGA], seen[:, Seen.SPAN]
    drive = 0.5 * span
    q_jump = now[:, Now.SLIDE] - seen[:, Seen.START_SLIDE]
    v_jump = now[:, Now.VELOCITY] - seen[:, Seen.START_VELOCITY]

    def derivatives(order, cosine, sine):
        """Return integrals of slide, velocity and acceleration times exp(-i order omega t)."""
        slide = seen[:, cosine] - 1j * seen[:, sine]
        velocity = q_jump + 1j * order * omega * slide
        return slide, velocity, v_jump + 1j * order * omega * velocity

    slide, velocity, first = derivatives(1, Seen.COS_1, Seen.SIN_1)
    third = derivatives(3, Seen.COS_3, Seen.SIN_3)[2]
    force = -1j * drive * columns[Number.DRIVE] - first
    force = force - columns[Number.DAMPING] * velocity - columns[Number.STIFFNESS] * slide
    force = force / columns[Number.MOBILITY]
    ratio = columns[Number.OUTPUT]
    fundamental = np.abs(ratio * first - 1j * drive * columns[Number.BASE]) * 2 / span
    count = np.maximum(seen[:, Seen.N_CYCLES], 1)
    half_range = seen[:, Seen.RANGE] / count / 2
    n_secants = seen[:, Seen.N_SECANTS]
    moves = slide_range > 1e-15
    damping = area / (2 * np.pi * cases.reference * half_range**2)
    is_known = moves & (cases.reference > 0)
    return {
        "absolute_acceleration_fundamental": fundamental,
        "acceleration_distortion": np.where(
            fundamental > MIN_ACCELERATION, np.abs(ratio * third) * 2 / span / fundamental, np.nan
        ),
        "equivalent_stiffness": np.where(moves, (force / slide).real, np.nan),
        "equivalent_damping": np.where(is_known, damping, np.nan),
        "secant_stiffness": np.where(
            moves & (n_secants > 0), seen[:, Seen.SECANT] / n_secants, np.nan
        ),
    }
