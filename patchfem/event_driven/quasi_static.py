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

from ..core import ModalBasis, PatchfemError
from ..friction.protocol import SteadyLoop
from .cases import Case, Interface, Options, UndrivenRig, make_rig, make_start
from .drives import make_tones
from .laws import masing
from .periodic import find_periodic_motion

SPEED_MESSAGE = "a friction force that depends on the sliding speed has no static loop"


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


def find_loop(
    interface: Interface, u: float, rtol: float | None = None, omega: float = 1.0
) -> SteadyLoop:
    """Return the friction loop of an interface at an amplitude u > 0 [m] of its slide.

    Laws without a closed form follow a sine.

    Parameters
    ----------
    interface : Interface
        Law and load.
    u : float
        Amplitude of the slide [m].
    rtol : float, optional
        Tolerance of a step of this motion.
    omega : float
        Its frequency [rad/s].
    """
    law = interface.law
    if law.law == "masing":
        return masing.find_loop(law, u)
    if law.law == "springs":
        cubic, stiffness, turn = law.numbers
        return SteadyLoop(cubic * u**3 + stiffness / turn * np.sin(turn * u), 0.0)

    # The periodic motion of a bench, whose slide is prescribed
    alone = [interface._replace(slide=np.ones(1))]
    signal = make_tones([(u, omega, 0.0)], 2 * np.pi / omega)
    # Tolerance of a step of a loop without a closed form
    rig = make_rig(None, signal, alone, (u, u * omega), Options(rtol=rtol or 1e-11))
    case = Case(rig, make_start(rig, alone), np.zeros(1), np.zeros(1), np.zeros(0), 1)
    values = find_periodic_motion(case).run.values
    return SteadyLoop(values["secant_stiffness"] * u, values["loop_area"])


def depends_on_speed(rig: UndrivenRig, u: float) -> bool:
    """Return whether a friction force of a rig depends on the sliding speed at an amplitude u [m] of the slides."""
    for one in rig.interfaces:
        # Ratio of two drive frequencies at which the loops of a law are compared
        slow, fast = (np.array(find_loop(one, u, omega=omega)) for omega in (1.0, 2.0))
        # Relative change of a loop that is due to its steps
        if (np.abs(fast - slow) > 1e-6 * np.abs([slow[0], slow[0] * u])).any():
            return True
    return False


def find_static_motions(
    rig: UndrivenRig, mode: int, amplitudes, row, rtol: float | None = None
) -> list[StaticMotion]:
    """Find the quasi-static motions of a mode at given amplitudes, with NaN where no equilibrium is found.

    Parameters
    ----------
    rig : UndrivenRig
        Modes of the structure without the contact, and laws of the interfaces.
    mode : int
        Index of the coordinate of the mode.
    amplitudes : array_like
        (k,) amplitudes [m] of the displacement row z, such as that of the output.
    row : ndarray
        (n,)
    rtol : float, optional
        Tolerance of a step, for loops without a closed form.

    Raises
    ------
    PatchfemError
        If a law depends on the velocity.
    """
    modes = rig.modes
    rows = rig.rows
    if depends_on_speed(rig, float(np.abs(rows).max()) * float(np.max(amplitudes))):
        raise PatchfemError(SPEED_MESSAGE)
    stiffness = rig.stiffness

    def find_motion(slides, amplitude: float) -> StaticMotion:
        """Return the motion of the mode at an amplitude [m], with the secants of the loops at slides (i,) [m]."""
        secants = stiffness.copy()
        loss = 0.0
        for k, (u, one) in enumerate(zip(slides, rig.interfaces)):
            if u > 0:
                loop = find_loop(one, u, rtol)
                secants[k] = loop.force / u
                loss += loop.area
        omega, shape = modes.compute_stuck_mode(rows, secants, mode)
        return _make_motion(modes, omega, shape * (amplitude / abs(float(row @ shape))), loss)

    # The slides of the mode must be those of its secants.
    motions = []
    for amplitude in amplitudes:
        stuck = np.abs(rows @ find_motion(np.zeros(stiffness.size), amplitude).z)
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
            return np.abs(rows @ find_motion(np.abs(x) * unit, amplitude).z) / unit - x

        # Change of the slides, relative to those of the stuck mode, at which their search ends
        solution = root(find_residual, stuck / unit, tol=1e-13)
        motion = find_motion(np.abs(solution.x) * unit, amplitude)
        # Relative error of the slides of an equilibrium
        if not (motion.omega and (np.abs(solution.fun) <= 1e-9).all()):
            motion = motion._replace(omega=np.nan, zeta=np.nan)
        motions.append(motion)
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
    loops : sequence of SteadyLoop
        (k,) loop at each amplitude.
    """
    motions = []
    for slide, loop in zip(slides, loops):
        omega, shape = modes.compute_stuck_mode(row[None], np.array([loop.force / slide]), mode)
        motions.append(_make_motion(modes, omega, shape * slide / (row @ shape), loop.area))
    return motions


def _make_motion(modes, omega: float, z, loss: float) -> StaticMotion:
    """Return the motion of an equilibrium z (n,) [m] with a frequency [rad/s] and a loss per cycle [J].

    The dampers of the structure, in `modes`, add to the loss.
    """
    viscous = np.pi * omega * modes.mass * float(z @ modes.damping_matrix @ z)
    work = 2 * np.pi * omega**2 * modes.mass * float(z @ z)
    zeta = (loss + viscous) / work if work else np.nan
    return StaticMotion(omega, zeta, z, float(loss))
