"""Motion of many cases of one mode and one contact point, and their measures."""

from typing import NamedTuple

import numpy as np

from .. import compiled
from ..core import ModalBasis, SineDrive
from ..friction import path_work
from .case_kernels import LEVELS, TICKS
from .case_rows import Cases, Now, Number, Seen
from .exponentials import exponential

ALWAYS_STUCK = 1e-12  # fraction of the time below which slip is round-off
MIN_ACCELERATION = 1e-9  # first harmonic [m s-2] below which it has no distortion
MIN_SLIDE_RANGE = 1e-15  # range of the slide [m] below which the contact is at rest


class CaseMarch(NamedTuple):
    """Results of c cases.

    - values: measures (c,) by name; NaN where a case does not have the measure
    - extremes (c, n, 2), phasors (c, n): of the output in every cycle [m]
    """

    values: dict[str, np.ndarray]
    extremes: np.ndarray
    phasors: np.ndarray


def list_parameters(
    modes: ModalBasis, drive: SineDrive, load, cycles: int, window: int, start=None
) -> tuple[float | np.ndarray, ...]:
    """Return the parameters of cases as the columns of `Cases.parameters`, in the order of `Number`.

    Parameters
    ----------
    modes : ModalBasis
        Of one mode that moves the contact; its numbers may be arrays (c,).
    drive : SineDrive
        Frequency and level, which may be arrays (c,).
    load : float or (c,)
        Normal load [N].
    cycles, window : int
        Number of cycles, and of the last of them that are measured.
    start : core.InitialState, optional
        Slide and velocity at the start; at rest by default.
    """
    slide = modes.slide[0]
    output = modes.output[0]
    return (
        modes.damping_matrix[0, 0],
        modes.omega[0] ** 2,
        -slide * modes.base[0] * drive.acceleration,
        slide**2 / modes.mass,
        drive.omega,
        load,
        output / slide,
        drive.acceleration * drive.moving,
        slide * (start.z[0] if start is not None else 0.0),
        slide * (start.v[0] if start is not None else 0.0),
        cycles,
        window,
    )


def march_cases(cases: Cases, steps: int) -> CaseMarch:
    """Run cases with a number of steps per cycle, and compute their measures.

    Parameters
    ----------
    cases : Cases
        With the same number of cycles.
    steps : int
        Whole steps per cycle; steps with an event are halved.
    """
    n = len(cases.parameters)
    columns = cases.parameters.T
    now = np.zeros((n, len(Now)))
    seen = np.zeros((n, len(Seen)))
    history = np.zeros((n, int(columns[Number.CYCLES].max(initial=0)), 4))
    compiled.load_compiled_module("points.case_kernels").march_cases(
        steps, make_responses(columns, steps), cases.parameters, cases.numbers,
        cases.memory.copy(), now, seen, history,
    )  # fmt: skip

    output = columns[Number.OUTPUT][:, None]
    phasors = (history[..., 2] - 1j * history[..., 3]) * columns[Number.OMEGA][:, None] / np.pi
    with np.errstate(all="ignore"):
        return CaseMarch(
            compute_measures(cases, now, seen, history),
            np.sort(history[..., :2] * output[..., None], axis=-1),
            phasors * output,
        )


def make_responses(columns, steps: int) -> np.ndarray:
    """Return slide and velocity after a step of each case per unit of what moves it, for the march of cases.

    Parameters
    ----------
    columns : (12, c) array
        Numbers of the cases, in the order of `Number`.
    steps : int
        Whole steps per cycle.

    Returns
    -------
    (c, LEVELS + 1, 2, 5) array
        Axis 1 is the number of halvings of the step. Axis 2 has slide and velocity at its end. Axis 3 has what moves
        them: slide and velocity at the start, and accelerations 1, t and t^2/2.
    """
    n = columns.shape[1]
    matrix = np.zeros((n, 5, 5))
    matrix[:, range(4), range(1, 5)] = 1.0
    matrix[:, 1, 0] = -columns[Number.STIFFNESS]
    matrix[:, 1, 1] = -columns[Number.DAMPING]
    shortest = 2 * np.pi / columns[Number.OMEGA] / steps / TICKS
    whole = exponential(matrix, shortest, np.arange(5.0))
    table = np.zeros((n, LEVELS + 1, 2, 5))
    for level in range(LEVELS, -1, -1):
        table[:, level] = whole[:, :2]
        whole = whole @ whole
    return table


def compute_measures(cases: Cases, now, seen, history) -> dict[str, np.ndarray]:
    """Return the measures (c,) of cases by name, from what the march has observed.

    Parameters
    ----------
    cases : Cases
        The cases that were run.
    now : (c, 20) array
        States at the end, in the order of `case_rows.Now`.
    seen : (c, 29) array
        What was observed, in the order of `case_rows.Seen`.
    history : (c, n, 4) array
        Extremes and phasor of every cycle.
    """
    columns = cases.parameters.T
    omega = columns[Number.OMEGA]
    ratio = columns[Number.OUTPUT]
    mass = 1 / columns[Number.MOBILITY]
    count = seen[:, Seen.N_CYCLES]
    span = seen[:, Seen.SPAN]
    window = int(columns[Number.WINDOW].max(initial=1))

    # Sums and extremes of the window.
    low = history[:, -window:, 0].min(axis=1)
    high = history[:, -window:, 1].max(axis=1)
    work = seen[:, Seen.WORK]
    stuck = seen[:, Seen.STUCK] / (omega * span)

    energies = _compute_energies(cases, now, mass)
    gap = np.abs(seen[:, Seen.SAMPLED] - work)
    size = seen[:, Seen.PASSED] + mass * (now[:, Now.POWER] + now[:, Now.STORED])

    # The relative displacement is that of the output; the loop area is that of one cycle.
    values = {
        "relative_displacement_amplitude": (high - low) / 2 * np.abs(ratio),
        "absolute_acceleration_peak": seen[:, Seen.MAX_ACCELERATION],
        "friction_force_peak": seen[:, Seen.MAX_FORCE],
        "slip_amplitude": (seen[:, Seen.MAX_SLIP] - seen[:, Seen.MIN_SLIP]) / 2,
        "stick_fraction": np.where(stuck > 1 - ALWAYS_STUCK, 1.0, stuck),
        "slip_start_phase": path_work.mean_slip_phase(
            seen[:, Seen.STARTS], seen[:, Seen.SLIP_START_PHASE_COS], seen[:, Seen.SLIP_START_PHASE_SIN]
        ),
        "normal_load": columns[Number.LOAD],
        "loop_area": work / count,
        "drift_per_cycle": (seen[:, Seen.LAST_MEAN] - seen[:, Seen.FIRST_MEAN])
        * omega / (2 * np.pi) / np.maximum(count - 1, 1),
        "work_check": np.divide(gap, size, out=np.zeros_like(gap), where=size > 0),
    }  # fmt: skip
    return values | energies | _compute_harmonics(cases, now, seen, values["loop_area"], high - low)


def _compute_energies(cases: Cases, now, mass) -> dict[str, np.ndarray]:
    """Return the energies [J] of the whole run and the relative error of their balance.

    `now` (c, 20) are the states of the cases at the end, in the order of `case_rows.Now`, and `mass` (c,) [kg] are their
    moving masses. Energies in `now` and in the parameters are per unit of this mass.
    """
    columns = cases.parameters.T
    stored = 0.5 * (now[:, Now.VELOCITY] ** 2 + columns[Number.STIFFNESS] * now[:, Now.SLIDE] ** 2)
    first = 0.5 * (
        columns[Number.VELOCITY] ** 2 + columns[Number.STIFFNESS] * columns[Number.SLIDE] ** 2
    )
    gap = now[:, Now.WORK_IN] + first - stored - now[:, Now.VISCOUS] - now[:, Now.FRICTION]
    size = now[:, Now.POWER] + now[:, Now.STORED]
    work = mass * now[:, Now.FRICTION]
    return {
        "energy_balance": np.divide(np.abs(gap), size, out=np.zeros_like(gap), where=size > 0),
        "friction_work": work,
        "energy_dissipated": work - now[:, Now.ELASTIC],
        "energy_created": np.zeros_like(work),
    }


def _compute_harmonics(cases: Cases, now, seen, area, slide_range) -> dict[str, np.ndarray]:
    """Return the measures that follow from the first and third harmonics of slide, force and acceleration.

    Over a window of whole cycles, the integral of q'' exp(-i w t) is [q'] + i w ([q] + i w Q) with the integral Q of
    q exp(-i w t), where [x] is the change of x over the window (integration by parts). At w = 3 omega the drive has no part,
    so that Q follows from the integral F of the force by the equation of motion q'' + c q' + k q = drive - mobility F:

        Q (k + i w (i w + c)) = -mobility F - [q'] - (i w + c) [q].

    The acceleration of the base, a sin(omega t), has the integral -i a span/2.

    Parameters
    ----------
    cases : Cases
        The c cases that were run.
    now : (c, 20) array
        States at the end, in the order of `case_rows.Now`.
    seen : (c, 29) array
        What was observed, in the order of `case_rows.Seen`.
    area : (c,) array
        Friction work per cycle [J].
    slide_range : (c,) array
        Range of the slide in the window [m].
    """
    columns = cases.parameters.T
    omega = columns[Number.OMEGA]
    span = seen[:, Seen.SPAN]
    base = -0.5j * span * columns[Number.BASE]
    q_jump = now[:, Now.SLIDE] - seen[:, Seen.START_SLIDE]
    v_jump = now[:, Now.VELOCITY] - seen[:, Seen.START_VELOCITY]

    # Integrals of slide, force and relative acceleration times exp(-i omega t)
    slide = seen[:, Seen.COS_1] - 1j * seen[:, Seen.SIN_1]
    force = seen[:, Seen.FORCE_COS_1] - 1j * seen[:, Seen.FORCE_SIN_1]
    acceleration_1 = v_jump + 1j * omega * (q_jump + 1j * omega * slide)

    # The same of exp(-3 i omega t), with the slide from the force
    w = 3j * omega
    force_3 = seen[:, Seen.FORCE_COS_3] - 1j * seen[:, Seen.FORCE_SIN_3]
    damping = columns[Number.DAMPING]
    load_3 = -columns[Number.MOBILITY] * force_3 - v_jump - (w + damping) * q_jump
    slide_3 = load_3 / (columns[Number.STIFFNESS] + w * (w + damping))
    acceleration_3 = v_jump + w * (q_jump + w * slide_3)

    # Amplitudes of the absolute acceleration of the output: an integral over the window is span/2 times the amplitude.
    ratio = columns[Number.OUTPUT]
    fundamental = np.abs(ratio * acceleration_1 + base) * 2 / span
    count = np.maximum(seen[:, Seen.N_CYCLES], 1)
    half_range = seen[:, Seen.RANGE] / count / 2

    # Stiffness and damping of a point that hardly moves are NaN.
    n_secants = seen[:, Seen.N_SECANTS]
    moves = slide_range > MIN_SLIDE_RANGE
    loss = area / (2 * np.pi * cases.reference * half_range**2)
    is_known = moves & (cases.reference > 0)
    return {
        "absolute_acceleration_fundamental": fundamental,
        "acceleration_distortion": np.where(
            fundamental > MIN_ACCELERATION,
            np.abs(ratio * acceleration_3) * 2 / span / fundamental,
            np.nan,
        ),
        "harmonic_force_ratio": np.abs(force / slide),
        "equivalent_stiffness": np.where(moves, (force / slide).real, np.nan),
        "equivalent_damping": np.where(is_known, loss, np.nan),
        "secant_stiffness": np.where(
            moves & (n_secants > 0), seen[:, Seen.SECANT] / n_secants, np.nan
        ),
    }
