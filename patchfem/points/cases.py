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
from .case_rows import Cases, Loop, Now, Number, Seen
from .law_rows import Law, LawNumber, Masing, Memory

# Nested reversals that parallel sliders remember. A decay by 3 % from one to the next has reached 2e-7 of its start. After
# decays of 1000 to 5000 reversals, forces of a motion that grows again are wrong by up to 4e-3 of the limit.
REVERSALS = 512


class CaseMarch(NamedTuple):
    """Results of c cases.

    - values: measures (c,) by name; NaN where a case does not have the measure
    - extremes (c, n, 2), phasors (c, n): of the output in every cycle [m]
    - stretches (c, 2): mean slide beyond the irreversible slide at the end, in the first and the last measured cycle [m]
    """

    values: dict[str, np.ndarray]
    extremes: np.ndarray
    phasors: np.ndarray
    stretches: np.ndarray


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
        With the same law and number of cycles.
    steps : int
        Fewest steps per cycle.
    """
    n = len(cases.parameters)
    columns = cases.parameters.T
    # The second row of a case is for the cycle before, the first cycle for those before the window.
    states = np.zeros((n, 2, len(Now)))
    seen = np.zeros((n, len(Seen)))
    history = np.zeros((n, int(columns[Number.CYCLES].max(initial=0)), 4))
    loops = np.full((n, 1 + int(columns[Number.WINDOW].max(initial=0)), len(Loop)), np.nan)
    is_masing = cases.numbers[0, LawNumber.LAW] == Law.MASING
    memory = np.zeros((n, Masing.STACK + 2 * REVERSALS if is_masing else len(Memory)))
    if is_masing:
        memory[:, Masing.VIRGIN] = 1.0
    kernels = compiled.load_compiled_module("points.case_march_kernels")
    kernels.march_cases(
        steps, cases.parameters, (cases.numbers, memory), states, seen, history, loops
    )
    now = states[:, 0]

    output = columns[Number.OUTPUT][:, None]
    phasors = (history[..., 2] - 1j * history[..., 3]) * columns[Number.OMEGA][:, None] / np.pi
    with np.errstate(all="ignore"):
        return CaseMarch(
            compute_measures(cases, now, seen, history, loops[:, 1:]),
            np.sort(history[..., :2] * output[..., None], axis=-1),
            phasors * output,
            find_mean_stretches(cases, now, seen, loops),
        )


def find_mean_stretches(cases: Cases, now, seen, loops) -> np.ndarray:
    """Return `CaseMarch.stretches`.

    Parameters
    ----------
    cases : Cases
        The c cases that were run.
    now : (c, 18) array
        States at the end, in the order of `case_rows.Now`.
    seen : (c, 20) array
        What was observed, in the order of `case_rows.Seen`.
    loops : (c, 1 + w, 5) array
        Cycles of the window, in the order of `case_rows.Loop`, after a row for those before it.
    """
    omega = cases.parameters[:, Number.OMEGA]
    n_measured = np.round(seen[:, Seen.SPAN] * omega / (2 * np.pi)).astype(int)
    ends = np.column_stack([-n_measured, np.full(len(omega), -1)])
    means = np.take_along_axis(loops[..., Loop.SLIDE], ends + loops.shape[1], axis=1)
    return means * omega[:, None] / (2 * np.pi) - now[:, [Now.SLIP]]


def is_linear_between_events(cases: Cases) -> bool:
    """Return whether the law of the cases is linear between events, so that their march is exact with any steps."""
    return cases.numbers[0, LawNumber.LAW] <= Law.JENKINS


def compute_measures(cases: Cases, now, seen, history, loops) -> dict[str, np.ndarray]:
    """Return the measures (c,) of a sweep row by name.

    Parameters
    ----------
    cases : Cases
        The cases that were run.
    now : (c, 18) array
        States at the end, in the order of `case_rows.Now`.
    seen : (c, 20) array
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
    harmonics = find_harmonics(cases, now, seen)
    observations = Observations(
        span=span,
        period=2 * np.pi / omega,
        force=seen[:, [Seen.MAX_FORCE]],
        slip=seen[:, [Seen.MIN_SLIP, Seen.MAX_SLIP]],
        stick=stick,
        work=work,
        harmonics=np.array([harmonics.slide, harmonics.force]),
        cycles=loops,
    )
    values |= measure_interface(observations, cases.reference)
    return values | measure_acceleration(harmonics.acceleration, harmonics.third, span)


def _compute_energies(cases: Cases, now) -> dict[str, np.ndarray]:
    """Return the energies (c,) [J] of the whole run by name, for the balance of `motion_measures`.

    `now` (c, 18) are the states of the cases at the end, in the order of `case_rows.Now`. Energies in `now` and in the
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


class Harmonics(NamedTuple):
    """Integrals (c,) over the window of c cases.

    - slide, force, acceleration: slide [m s], friction force [N s] and absolute acceleration of the output [m/s] times
      exp(-i omega t)
    - third: this acceleration times exp(-3 i omega t)
    """

    slide: np.ndarray
    force: np.ndarray
    acceleration: np.ndarray
    third: np.ndarray


def find_harmonics(cases: Cases, now, seen) -> Harmonics:
    """Return the `Harmonics` of cases by integration by parts from the slide.

    Over a window of whole cycles, the integral of q'' exp(-i w t) is [q'] + i w ([q] + i w Q) with the integral Q of
    q exp(-i w t), where [x] is the change of x over the window. That of the friction force follows from the equation of
    motion q'' + c q' + k q = d sin(omega t) - mobility F. A sine of amplitude a has the integral -i a span/2 at w = omega.

    Parameters
    ----------
    cases : Cases
        The c cases that were run.
    now : (c, 18) array
        States at the end, in the order of `case_rows.Now`.
    seen : (c, 20) array
        What was observed, in the order of `case_rows.Seen`.
    """
    columns = cases.parameters.T
    q_jump = now[:, Now.SLIDE] - seen[:, Seen.START_SLIDE]
    v_jump = now[:, Now.VELOCITY] - seen[:, Seen.START_VELOCITY]
    sine = -0.5j * seen[:, Seen.SPAN]

    slide = seen[:, Seen.COS_1] - 1j * seen[:, Seen.SIN_1]
    w = 1j * columns[Number.OMEGA]
    velocity = q_jump + w * slide
    acceleration = v_jump + w * velocity
    force = sine * columns[Number.DRIVE] - acceleration
    force -= columns[Number.DAMPING] * velocity + columns[Number.STIFFNESS] * slide

    slide_3 = seen[:, Seen.COS_3] - 1j * seen[:, Seen.SIN_3]
    third = v_jump + 3 * w * (q_jump + 3 * w * slide_3)
    ratio = columns[Number.OUTPUT]
    return Harmonics(
        slide,
        force / columns[Number.MOBILITY],
        ratio * acceleration + sine * columns[Number.BASE],
        ratio * third,
    )
