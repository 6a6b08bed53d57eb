"""Quasi-static backbone of a mode, from a static force along the mode shape and friction loops.

The inertia force m omega^2 z of a deflection z holds it in equilibrium: m omega_i^2 z_i + (rows^T F)_i =
m omega^2 z_i. The slides reverse together, so each law runs through its own loop, whose tip is F, and
omega is the natural frequency with the secant stiffness of the loops: that of the stuck mode at small
amplitudes, and that of the mode without the contact at large ones. The damping is what the loops lose
of 2 pi m omega^2 z z. Where a law follows Masing's rule the loop is its curve of first loading, twice
as large: one static curve gives both (Festjens, Chevallier and Dion 2013, with the distribution of the
force updated by the deflection; Lacayo and Allen 2019). A force with the fixed shape of the stuck mode
would not tend to the free mode if several modes move the contact.
"""

from itertools import chain
from typing import NamedTuple

import numpy as np
from scipy.optimize import root

from ...core import ModalBasis, NotConverged, PatchfemError
from ...formatting import format_length
from ...friction.laws.elastic_plastic import masing_loop
from .forces import LawGroup
from .laws import Jenkins, SampledSlide

# Relative increment of the slide for the finite difference of the tip force of a loop.
RELATIVE_SLIDE_STEP = 1e-6
# Ratio of the two drive frequencies at which a law is compared to detect a dependence on speed.
TEST_RATE_RATIO = 2.0
# Largest relative change of a force that is attributed to round-off.
FORCE_TOL = 1e-9
SPEED_MESSAGE = "a friction force that depends on the sliding speed has no static loop"


class StaticLoops(NamedTuple):
    """Force [N] at the tip, and area [J], of the friction loop of an interface."""

    tip: float
    area: float


class StaticMotion(NamedTuple):
    """Quasi-static motion of a mode, with its frequency and damping ratio.

    - amplitude: amplitude of the motion along the shape of the given mode [m]
    - omega, zeta: frequency [rad/s] and damping ratio
    - z: (n,) modal coordinates at the reversal [m]
    - loss: friction loss per cycle [J]
    """

    amplitude: float
    omega: float
    zeta: float
    z: np.ndarray
    loss: float


def find_loops(laws, u: float, samples: int) -> StaticLoops:
    """Compute the tip force and the area of the friction loop on an interface row.

    Parameters
    ----------
    laws : sequence
        Laws on one row.
    u : float
        Amplitude of the slide, >= 0 [m].
    samples : int
        Samples of a cycle, for laws that have no closed form.

    Returns
    -------
    StaticLoops
    """
    loops = []
    for law in laws:
        if isinstance(law, Jenkins):
            tip, area = masing_loop(law.stiffness, law.limit_slide, u)
            loops.append(StaticLoops(float(tip), float(area)))
        else:
            loops.append(_sample_loops(law, u, samples))
    return StaticLoops(sum(loop.tip for loop in loops), sum(loop.area for loop in loops))


def _sample_loops(law, u: float, samples: int) -> StaticLoops:
    """Compute the tip force and area of a rate-independent law's loop by sampling a cycle."""
    if u == 0:
        return StaticLoops(0.0, 0.0)
    track = SampledSlide(np.array([0.0, u], complex), 1.0, samples)
    force = law.sample(track).force
    return StaticLoops(
        float(force[0] - force[samples // 2]) / 2, float(force @ track.rate) * 2 * np.pi / samples
    )


def depends_on_speed(group: LawGroup, u: float) -> bool:
    """Return whether any friction force in the group depends on the sliding speed.

    u: amplitude of the slide [m] at which the laws are sampled.

    """
    for law in chain.from_iterable(group.laws):
        if isinstance(law, Jenkins):
            continue
        slide = np.array([0.0, u], complex)
        slow = law.sample(SampledSlide(slide, 1.0, 512)).force
        fast = law.sample(SampledSlide(slide, TEST_RATE_RATIO, 512)).force
        if np.abs(fast - slow).max() > FORCE_TOL * np.abs(slow).max(initial=1e-300):
            return True
    return False


def find_static_motions(
    modes: ModalBasis, group: LawGroup, amplitudes, stuck_mode: tuple, samples: int = 4096, row=None
) -> list:
    """Compute the quasi-static motions of a mode at given amplitudes.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure, excluding the contact.
    group : LawGroup
        Laws on the rows.
    amplitudes : array_like
        (k,) amplitudes of the motion along the shape, or along `row` [m].
    stuck_mode : tuple
        Frequency [rad/s] and shape (n,) of the stuck mode.
    samples : int, optional
        Samples per cycle, for laws that have no closed form.
    row : ndarray, optional
        (n,) displacement per coordinate to which the amplitudes belong, such as that of the output;
        the component along the shape by default.

    Returns
    -------
    list of StaticMotion
        One motion per amplitude, with NaN if no equilibrium is found.

    Raises
    ------
    PatchfemError
        If a law depends on the velocity.
    """
    if depends_on_speed(group, float(np.abs(group.rows).max()) * float(np.max(amplitudes))):
        raise PatchfemError(SPEED_MESSAGE)
    omega, shape = stuck_mode
    motions = []
    guess = np.append(shape, 1.0)
    row = shape / (shape @ shape) if row is None else row
    for amplitude in amplitudes:
        try:
            guess = _solve_equilibrium(
                modes, group, (*stuck_mode, row), float(amplitude), guess, samples
            )
        except NotConverged:
            motions.append(
                StaticMotion(
                    float(amplitude), np.nan, np.nan, np.full(modes.omega.size, np.nan), np.nan
                )
            )
            continue
        z = guess[:-1] * amplitude
        square = float(guess[-1]) * omega**2
        slides = np.abs(group.rows @ z)
        areas = [find_loops(laws, u, samples).area for u, laws in zip(slides, group.laws)]
        loss = sum(areas)
        motions.append(_make_static_motion(modes, shape, (z, square, loss)))
    return motions


def find_static_motions_from_loops(modes: ModalBasis, row, mode: int, slides, loops) -> list:
    """Compute the quasi-static motions of a mode with one interface whose friction loops are known.

    Parameters
    ----------
    modes : ModalBasis
    row : ndarray
        (n,) slide per coordinate.
    mode : int
        Index of the coordinate of the mode.
    slides : array_like
        (k,) amplitudes of the slide [m], > 0.
    loops : sequence of StaticLoops
        (k,) loop at each amplitude.

    Returns
    -------
    list of StaticMotion
    """
    row = np.asarray(row)
    motions = []
    for slide, loop in zip(slides, loops):
        secant_stiffness = np.array([loop.tip / slide])
        omega, shape = modes.compute_stuck_mode(row[None], secant_stiffness, mode)
        z = shape * slide / (row @ shape)
        motions.append(_make_static_motion(modes, shape, (z, omega**2, loop.area)))
    return motions


def _solve_equilibrium(
    modes, group, mode: tuple, amplitude: float, guess, samples: int
) -> np.ndarray:
    """Solve for the static equilibrium of a mode at a given amplitude [m].

    Returns z/amplitude, and the squared frequency relative to that of the stuck mode. mode: frequency [rad/s] and
    shape of the stuck mode, and the row of the amplitude.
    """
    omega, shape, row = mode
    m = modes.mass
    n = modes.omega.size
    modal_stiffness = np.diag(modes.omega**2) / omega**2

    def find_residual(x):
        slides = group.rows @ x[:n] * amplitude
        tips = [find_loops(laws, abs(u), samples).tip for u, laws in zip(slides, group.laws)]
        force = np.sign(slides) * np.array(tips)
        return np.append(
            modal_stiffness @ x[:n]
            + group.rows.T @ force / (m * omega**2 * amplitude)
            - x[n] * x[:n],
            row @ x[:n] - 1,
        )

    def find_slopes(x):
        u = np.abs(group.rows @ x[:n] * amplitude)
        tip_slopes = [_find_tip_slope(laws, slide, samples) for slide, laws in zip(u, group.laws)]
        stiffness = modal_stiffness + group.rows.T * tip_slopes @ group.rows / (m * omega**2)
        stiffness -= x[n] * np.eye(n)
        return np.block([[stiffness, -x[:n, None]], [row[None], np.zeros((1, 1))]])

    for start in (guess, np.append(shape, 1.0)):
        solution = root(find_residual, start, jac=find_slopes, tol=1e-13)
        if np.abs(solution.fun).max() < 1e-9:
            return solution.x
    raise NotConverged(
        f"backbone: no equilibrium was found at the amplitude {format_length(amplitude, 3)} of the static curve"
    )


def _find_tip_slope(laws, u: float, samples: int) -> float:
    """Return the derivative [N/m] of the force at the loop tip by the displacement amplitude."""
    step = max(RELATIVE_SLIDE_STEP * u, 1e-30)
    return (find_loops(laws, u + step, samples).tip - find_loops(laws, u, samples).tip) / step


def _make_static_motion(modes, shape, motion: tuple) -> StaticMotion:
    """Return the quasi-static motion, with frequency and damping ratio, for an equilibrium.

    motion: z (n,) [m], squared frequency [rad2 s-2] and loss [J].

    """
    z, square, loss = motion
    component = float(shape @ z / (shape @ shape))
    omega = float(np.sqrt(square)) if square > 0 else np.nan
    viscous = np.pi * omega * modes.mass * float(z @ modes.damping_matrix @ z)
    work = 2 * np.pi * square * modes.mass * float(z @ z)
    return StaticMotion(component, omega, (loss + viscous) / work, z, float(loss))
