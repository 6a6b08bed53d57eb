"""Quasi-static backbone of a mode, from a static force along the mode shape and friction loops.

The inertia force m omega^2 z of a deflection z holds it in equilibrium: m omega_i^2 z_i + (rows^T F)_i = m omega^2 z_i. The
slides reverse together, so each law runs through its own loop, whose tip is F, and omega and z are the natural mode
with the secant stiffness of the loops: the stuck mode at small amplitudes, and the mode without the contact at large
ones. The damping is what the loops lose of 2 pi m omega^2 z z. Where a law follows Masing's rule the loop is its curve of
first loading, twice as large: one static curve gives both (Festjens, Chevallier and Dion 2013, with the distribution of
the force updated by the deflection; Lacayo and Allen 2019). A force with the fixed shape of the stuck mode would not
tend to the free mode if several modes move the contact.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import root

from ...core import ModalBasis, PatchfemError
from ...friction.laws.elastic_plastic import masing_loop
from .forces import LawGroup
from .laws import Jenkins
from .slides import make_slides

TEST_RATE_RATIO = 2.0  # ratio of two drive frequencies at which the forces of a law are compared
TEST_SAMPLES = 512  # samples per cycle of this comparison
FORCE_TOL = 1e-9  # relative change of a force that is round-off
SLIDE_ROOT_TOL = (
    1e-13  # change of the slides, relative to those of the stuck mode, at which their search ends
)
SLIDE_TOL = 1e-9  # relative error of the slides of an equilibrium
SPEED_MESSAGE = "a friction force that depends on the sliding speed has no static loop"


class StaticLoops(NamedTuple):
    """Force [N] at the tip, and area [J], of the friction loop of an interface."""

    tip: float
    area: float


class StaticMotion(NamedTuple):
    """Quasi-static motion of a mode, with its frequency and damping ratio.

    - omega, zeta: frequency [rad/s] and damping ratio
    - z: (n,) modal coordinates at the reversal [m]
    - loss: friction loss per cycle [J]
    """

    omega: float
    zeta: float
    z: np.ndarray
    loss: float


def find_loops(laws, u: float, samples: int) -> StaticLoops:
    """Return the tip force and the area of the friction loop of an interface row.

    Parameters
    ----------
    laws : sequence
        Laws on one row.
    u : float
        Amplitude of the slide, >= 0 [m].
    samples : int
        Samples of a cycle, for laws that have no closed form.
    """
    tip = area = 0.0
    slides = make_slides([[0.0, u]], 1.0, samples)
    for law in laws:
        if isinstance(law, Jenkins):
            law_tip, law_area = masing_loop(law.stiffness, law.limit_slide, u)
        else:
            force = law.evaluate(slides, 0).force[slides.is_sample]
            law_tip = (force[0] - force[samples // 2]) / 2
            law_area = force @ slides.rate[0, slides.is_sample] * 2 * np.pi / samples
        tip += float(law_tip)
        area += float(law_area)
    return StaticLoops(tip, area)


def depends_on_speed(group: LawGroup, u: float) -> bool:
    """Return whether a friction force of the group depends on the sliding speed at an amplitude u [m] of the slides."""
    slides = np.tile([0.0, u], (len(group.rows), 1))
    slow, fast = (
        group.compute_forces(slides, omega, TEST_SAMPLES) for omega in (1.0, TEST_RATE_RATIO)
    )
    return bool((np.abs(fast - slow).max(axis=1) > FORCE_TOL * np.abs(slow).max(axis=1)).any())


def find_static_motions(
    modes: ModalBasis, group: LawGroup, mode: int, amplitudes, row, samples: int = 4096
) -> list[StaticMotion]:
    """Find the quasi-static motions of a mode at given amplitudes, with NaN where no equilibrium is found.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure, without the contact.
    group : LawGroup
        Laws of the interfaces.
    mode : int
        Index of the coordinate of the mode.
    amplitudes : array_like
        (k,) amplitudes [m] of the displacement row z, such as that of the output.
    row : ndarray
        (n,)
    samples : int, optional
        Samples per cycle, for laws that have no closed form.

    Raises
    ------
    PatchfemError
        If a law depends on the velocity.
    """
    if depends_on_speed(group, float(np.abs(group.rows).max()) * float(np.max(amplitudes))):
        raise PatchfemError(SPEED_MESSAGE)
    stiffness = group.stiffness()

    def find_mode(slides, amplitude: float) -> tuple[float, np.ndarray, list[StaticLoops]]:
        """Return frequency, coordinates at an amplitude, and loops of the mode with the secants at slides (i,) [m]."""
        loops = [find_loops(laws, u, samples) for u, laws in zip(slides, group.laws)]
        secants = [loop.tip / u if u > 0 else k for u, loop, k in zip(slides, loops, stiffness)]
        omega, shape = modes.compute_stuck_mode(group.rows, np.array(secants), mode)
        return omega, shape * (amplitude / abs(float(row @ shape))), loops

    # The slides of the mode must be those of its secants.
    motions = []
    for amplitude in amplitudes:
        stuck = np.abs(group.rows @ find_mode(np.zeros(stiffness.size), amplitude)[1])
        unit = np.maximum(stuck, 1e-300)

        def find_residual(x, amplitude=amplitude, unit=unit) -> np.ndarray:
            """Return the residual (i,) of the slides: those of the mode with the secants at x, less x.

            Parameters
            ----------
            x : (i,) array
                Slides relative to those of the stuck mode.
            amplitude : float
                Amplitude of the displacement row [m].
            unit : (i,) array
                Slides of the stuck mode [m].
            """
            return np.abs(group.rows @ find_mode(np.abs(x) * unit, amplitude)[1]) / unit - x

        solution = root(find_residual, stuck / unit, tol=SLIDE_ROOT_TOL)
        omega, z, loops = find_mode(np.abs(solution.x) * unit, amplitude)
        if not (omega and (np.abs(solution.fun) <= SLIDE_TOL).all()):
            omega = np.nan
        motions.append(_make_motion(modes, omega, z, sum(loop.area for loop in loops)))
    return motions


def find_static_motions_from_loops(
    modes: ModalBasis, row, mode: int, slides, loops
) -> list[StaticMotion]:
    """Find the quasi-static motions of a mode with one interface whose friction loops are known.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure, without the contact.
    row : ndarray
        (n,) slide per coordinate.
    mode : int
        Index of the coordinate of the mode.
    slides : array_like
        (k,) amplitudes of the slide [m], > 0.
    loops : sequence of StaticLoops
        (k,) loop at each amplitude.
    """
    motions = []
    for slide, loop in zip(slides, loops):
        omega, shape = modes.compute_stuck_mode(row[None], np.array([loop.tip / slide]), mode)
        motions.append(_make_motion(modes, omega, shape * slide / (row @ shape), loop.area))
    return motions


def _make_motion(modes, omega: float, z, loss: float) -> StaticMotion:
    """Return the motion of an equilibrium z (n,) [m] with a frequency [rad/s] and a loss per cycle [J].

    The dampers of the structure, in `modes`, add to the loss.
    """
    viscous = np.pi * omega * modes.mass * float(z @ modes.damping_matrix @ z)
    work = 2 * np.pi * omega**2 * modes.mass * float(z @ z)
    return StaticMotion(omega, (loss + viscous) / work, z, float(loss))
