"""Motion of many cases of one mode and one contact point, and their measures."""

from typing import NamedTuple

import numpy as np

from .. import compiled
from ..core import ModalBasis, SineDrive
from ..motion_measures import (
    Observations,
    energy_balance,
    measure_acceleration,
    measure_interface,
    ratio_or_zero,
)
from ..structure.exponentials import exponential
from .case_kernels import LEVELS, TICKS
from .case_rows import Cases, Loop, Now, Number, Seen


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
    # The first row is for the cycles before the window.
    loops = np.full((n, 1 + int(columns[Number.WINDOW].max(initial=0)), len(Loop)), np.nan)
    compiled.load_compiled_module("points.case_kernels").march_cases(
        steps, make_responses(columns, steps), cases.parameters, cases.numbers,
        cases.memory.copy(), now, seen, history, loops,
    )  # fmt: skip

    output = columns[Number.OUTPUT][:, None]
    phasors = (history[..., 2] - 1j * history[..., 3]) * columns[Number.OMEGA][:, None] / np.pi
    with np.errstate(all="ignore"):
        return CaseMarch(
            compute_measures(cases, now, seen, history, loops[:, 1:]),
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


def compute_measures(cases: Cases, now, seen, history, loops) -> dict[str, np.ndarray]:
    """Return the measures (c,) of a sweep row by name.

    Parameters
    ----------
    cases : Cases
        The cases that were run.
    now : (c, 20) array
        States at the end, in the order of `case_rows.Now`.
    seen : (c, 22) array
        What was observed, in the order of `case_rows.Seen`.
    history : (c, n, 4) array
        Extremes and phasor of every cycle.
    loops : (c, w, 5) array
        Cycles of the window, in the order of `case_rows.Loop`.
    """
    columns = cases.parameters.T
    omega = columns[Number.OMEGA]
    span = seen[:, Seen.SPAN]
    output = history[:, -loops.shape[1] :, :2] * columns[Number.OUTPUT][:, None, None]
    work = seen[:, Seen.WORK]
    energies = _compute_energies(cases, now)
    exchanged = seen[:, Seen.PASSED] + energies["power"] + energies["peak_stored"]

    values = {
        "relative_displacement_amplitude": np.ptp(output, axis=(1, 2)) / 2,
        "absolute_acceleration_peak": seen[:, Seen.MAX_ACCELERATION],
        "normal_load": columns[Number.LOAD],
        "work_check": ratio_or_zero(np.abs(seen[:, Seen.SAMPLED] - work), exchanged),
        "energy_balance": energy_balance(energies),
        "friction_work": energies["friction"],
        "energy_dissipated": energies["friction"] - now[:, Now.ELASTIC],
        "energy_created": np.zeros_like(work),
    }
    # The time of stick in place of the phase of the drive that passes during stick.
    stick = seen[:, Seen.STUCK : Seen.SLIP_START_PHASE_SIN + 1].T.copy()
    stick[0] /= omega
    slide = seen[:, Seen.COS_1] - 1j * seen[:, Seen.SIN_1]
    force = seen[:, Seen.FORCE_COS_1] - 1j * seen[:, Seen.FORCE_SIN_1]
    observations = Observations(
        span=span,
        period=2 * np.pi / omega,
        force=seen[:, [Seen.MAX_FORCE]],
        slip=seen[:, [Seen.MIN_SLIP, Seen.MAX_SLIP]],
        stick=stick,
        work=work,
        harmonics=np.array([slide, force]),
        cycles=loops,
    )
    values |= measure_interface(observations, cases.reference)
    return values | measure_acceleration(*_integrate_acceleration(cases, now, seen, slide), span)


def _compute_energies(cases: Cases, now) -> dict[str, np.ndarray]:
    """Return the energies (c,) [J] of the whole run by name, for the balance of `motion_measures`.

    `now` (c, 20) are the states of the cases at the end, in the order of `case_rows.Now`. Energies in `now` and in the
    parameters are per unit of the moving mass.
    """
    columns = cases.parameters.T
    stiffness = columns[Number.STIFFNESS]
    last = now[:, Now.VELOCITY] ** 2 + stiffness * now[:, Now.SLIDE] ** 2
    first = columns[Number.VELOCITY] ** 2 + stiffness * columns[Number.SLIDE] ** 2
    energies = {
        "work_in": now[:, Now.WORK_IN],
        "viscous": now[:, Now.VISCOUS],
        "power": now[:, Now.POWER],
        "friction": now[:, Now.FRICTION],
        "stored": 0.5 * (last - first),
        "peak_stored": now[:, Now.STORED],
    }
    return {name: energy / columns[Number.MOBILITY] for name, energy in energies.items()}


def _integrate_acceleration(cases: Cases, now, seen, slide) -> tuple[np.ndarray, np.ndarray]:
    """Return the integrals (c,) [m/s] of the absolute acceleration times exp(-i omega t) and exp(-3 i omega t).

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
    seen : (c, 22) array
        What was observed, in the order of `case_rows.Seen`.
    slide : (c,) array
        Integral of the slide times exp(-i omega t) [m s].
    """
    columns = cases.parameters.T
    omega = columns[Number.OMEGA]
    ratio = columns[Number.OUTPUT]
    q_jump = now[:, Now.SLIDE] - seen[:, Seen.START_SLIDE]
    v_jump = now[:, Now.VELOCITY] - seen[:, Seen.START_VELOCITY]
    first = v_jump + 1j * omega * (q_jump + 1j * omega * slide)
    base = -0.5j * seen[:, Seen.SPAN] * columns[Number.BASE]

    # The third harmonic of the slide follows from that of the force.
    w = 3j * omega
    damping = columns[Number.DAMPING]
    force = seen[:, Seen.FORCE_COS_3] - 1j * seen[:, Seen.FORCE_SIN_3]
    load = -columns[Number.MOBILITY] * force - v_jump - (w + damping) * q_jump
    slide_3 = load / (columns[Number.STIFFNESS] + w * (w + damping))
    third = v_jump + w * (q_jump + w * slide_3)
    return ratio * first + base, ratio * third
