"""Motion of many cases of one mode and one contact point, and their measures."""

from typing import NamedTuple

import numpy as np

from .. import kernel_cache
from ..core import ModalBasis, SineDrive
from ..motion_measures import (
    Observations,
    energy_balance,
    measure_acceleration,
    measure_interface,
    ratio_or_zero,
)
from .rows import (
    Cases,
    Energy,
    Law,
    LawNumber,
    Loop,
    Masing,
    Memory,
    Number,
    PointLaw,
    Record,
    Seen,
)

# Nested reversals that parallel sliders remember. A decay by 3 % from one to the next has reached 2e-7 of its start. After
# decays of 1000 to 5000 reversals, forces of a motion that grows again are wrong by up to 4e-3 of the limit.
REVERSALS = 512


class CaseMarch(NamedTuple):
    """Results of c cases.

    - values: measures (c,) by name; NaN where a case does not have the measure
    - extremes (c, n, 2), phasors (c, n): of the output in every cycle [m]
    - repeat (c,): change of the motion in a cycle, relative to its range, at which it counts as one that repeats; 0 if all
      cycles are computed
    - stretches (c, 2): mean slide beyond the irreversible slide at the end, in the first and the last measured cycle [m]
    """

    values: dict[str, np.ndarray]
    extremes: np.ndarray
    phasors: np.ndarray
    repeat: np.ndarray
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
    n_cycles = int(columns[Number.CYCLES].max(initial=0))
    record = Record(
        np.zeros((n, 2, len(Energy))),
        np.zeros((n, len(Seen))),
        np.zeros((n, 2), complex),
        np.zeros((n, n_cycles), complex),
        np.full((n, n_cycles, len(Loop)), np.nan),
    )
    is_masing = cases.numbers[0, LawNumber.LAW] == Law.MASING
    memory = np.zeros((n, Masing.STACK + 2 * REVERSALS if is_masing else len(Memory)))
    if is_masing:
        memory[:, Masing.VIRGIN] = 1.0
    kernels = kernel_cache.load_compiled_module("points.march_kernels")
    kernels.march_cases(steps, cases.parameters, PointLaw(cases.numbers, memory), record)

    output = columns[Number.OUTPUT][:, None]
    extremes = record.loops[..., [Loop.MIN_SLIDE, Loop.MAX_SLIDE]] * output[..., None]
    with np.errstate(all="ignore"):
        return CaseMarch(
            compute_measures(cases, record),
            np.sort(extremes, axis=-1),
            record.phasors * columns[Number.OMEGA][:, None] / np.pi * output,
            record.seen[:, Seen.REPEAT],
            _find_mean_stretches(cases, record),
        )


def _find_mean_stretches(cases: Cases, record: Record) -> np.ndarray:
    """Return `CaseMarch.stretches` of the cases that were run."""
    omega = cases.parameters[:, Number.OMEGA]
    n_measured = np.round(record.seen[:, Seen.SPAN] * omega / (2 * np.pi)).astype(int)
    ends = np.column_stack([-n_measured, np.full(len(omega), -1)])
    integrals = record.loops[..., Loop.SLIDE]
    means = np.take_along_axis(integrals, ends + integrals.shape[1], axis=1)
    return means * omega[:, None] / (2 * np.pi) - record.seen[:, [Seen.END_SLIP]]


def is_linear_between_events(cases: Cases) -> bool:
    """Return whether the law of the cases is linear between events, so that their march is exact with any steps."""
    return cases.numbers[0, LawNumber.LAW] <= Law.JENKINS


def compute_measures(cases: Cases, record: Record) -> dict[str, np.ndarray]:
    """Return the measures (c,) of a sweep row by name, of the c cases that were run."""
    columns = cases.parameters.T
    omega = columns[Number.OMEGA]
    seen = record.seen
    span = seen[:, Seen.SPAN]
    loops = record.loops[:, -int(columns[Number.WINDOW].max(initial=0)) :]
    low = loops[..., Loop.MIN_SLIDE].min(axis=1)
    high = loops[..., Loop.MAX_SLIDE].max(axis=1)
    work = seen[:, Seen.WORK]
    energies = _compute_energies(cases, record)
    exchanged = seen[:, Seen.PASSED] + energies["power"] + energies["peak_stored"]

    values = {
        "relative_displacement_amplitude": np.abs(columns[Number.OUTPUT]) * (high - low) / 2,
        "absolute_acceleration_peak": seen[:, Seen.MAX_ACCELERATION],
        "normal_load": columns[Number.LOAD],
        "work_check": ratio_or_zero(np.abs(seen[:, Seen.SAMPLED] - work), exchanged),
        "energy_balance": energy_balance(energies),
        "friction_work": energies["friction"],
        "energy_dissipated": energies["friction"] - record.energies[:, 0, Energy.ELASTIC],
        "energy_created": np.zeros_like(work),
    }
    # The time of stick in place of the phase of the drive that passes during stick.
    stick = seen[:, Seen.STUCK : Seen.SIN_START + 1].T.copy()
    stick[0] /= omega
    harmonics = find_harmonics(cases, record)
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


def _compute_energies(cases: Cases, record: Record) -> dict[str, np.ndarray]:
    """Return the energies (c,) [J] of the whole run by name, for the balance of `motion_measures`."""
    columns = cases.parameters.T
    stiffness = columns[Number.STIFFNESS]
    seen = record.seen.T
    last = seen[Seen.END_VELOCITY] ** 2 + stiffness * seen[Seen.END_SLIDE] ** 2
    first = columns[Number.VELOCITY] ** 2 + stiffness * columns[Number.SLIDE] ** 2
    names = ("work_in", "power", "viscous", "friction", "peak_stored")
    energies = dict(zip(names, record.energies[:, 0].T)) | {"stored": 0.5 * (last - first)}
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


def find_harmonics(cases: Cases, record: Record) -> Harmonics:
    """Return the `Harmonics` of cases by integration by parts from the slide.

    Over a window of whole cycles, the integral of q'' exp(-i w t) is [q'] + i w ([q] + i w Q) with the integral Q of
    q exp(-i w t), where [x] is the change of x over the window. That of the friction force follows from the equation of
    motion q'' + c q' + k q = d sin(omega t) - mobility F. A sine of amplitude a has the integral -i a span/2 at w = omega.
    """
    columns = cases.parameters.T
    seen = record.seen.T
    q_jump = seen[Seen.END_SLIDE] - seen[Seen.START_SLIDE]
    v_jump = seen[Seen.END_VELOCITY] - seen[Seen.START_VELOCITY]
    sine = -0.5j * seen[Seen.SPAN]

    slide, slide_3 = record.harmonics.T
    w = 1j * columns[Number.OMEGA]
    velocity = q_jump + w * slide
    acceleration = v_jump + w * velocity
    force = sine * columns[Number.DRIVE] - acceleration
    force -= columns[Number.DAMPING] * velocity + columns[Number.STIFFNESS] * slide

    third = v_jump + 3 * w * (q_jump + 3 * w * slide_3)
    ratio = columns[Number.OUTPUT]
    return Harmonics(
        slide,
        force / columns[Number.MOBILITY],
        ratio * acceleration + sine * columns[Number.BASE],
        ratio * third,
    )
