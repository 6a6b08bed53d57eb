"""Balance of the first harmonic of a driven rig, an estimate from which periodic motions are found.

With slides u = Im(U exp(i omega t)) the friction of parallel elements has the first harmonic K U, where K follows from
Masing's rules and |U|. The motion of the modes is then that of a linear rig, and |U| is found by successive substitution.
"""

from typing import NamedTuple

import numpy as np

from ..core import ModalBasis
from ..structure.response import compute_receptance
from .cases import Case, Load, make_arrays
from .laws import LAWS, masing
from .records import Face, LawNumbers, Memory, Setting, State

N_NODES = 48  # nodes of Gauss's rule over a branch of a loop, which is exact while no element slips
N_AMPLITUDES = 200  # amplitudes of the table of a law, evenly in the logarithm
# Height of the first-harmonic balance from which on a frequency is examined, relative to the highest steady motion. For the
# damper of the template, whose second mode answers to the third harmonic, the balance exceeds the motion by up to 150 %
# and falls short of it by 20 %.
MIN_HEIGHT_RATIO = 0.7


class BalancedMotions(NamedTuple):
    """First harmonics of the motions of a rig at k frequencies, as complex amplitudes.

    - omega: (k,) increasing circular frequencies [rad/s]
    - modes: (k, n) modal coordinates [m]
    - slides: (k, i) relative displacements of the interfaces [m]
    """

    omega: np.ndarray
    modes: np.ndarray
    slides: np.ndarray

    def make_start(self, case: Case) -> State:
        """Return the state at the start of a period of a case, interpolated to its frequency.

        Elements remember the loop between both reversals of the slide.
        """
        state = make_arrays(case)[0]
        n = self.modes.shape[1]
        omega = case.rig.settings[Setting.OMEGA]
        modes, slides = (
            np.array([np.interp(omega, self.omega, column) for column in table.T])
            for table in (self.modes, self.slides)
        )
        state.y[:n] = modes.imag
        state.y[n : 2 * n] = omega * modes.real
        for face, memory, slide in zip(case.rig.faces, state.memory, slides):
            if LAWS[int(face[Face.LAW])] != "masing":
                continue
            memory[Memory.COUNT] = 0
            memory[Memory.DIRECTION] = 1.0 if slide.real >= 0 else -1.0
            ends = (-abs(slide), abs(slide))
            masing.remember_loop(face[Face.NUMBERS :], memory, ends, slide.imag)
        return state


def balance_first_harmonic(
    modes: ModalBasis, joints, acceleration: float, omega
) -> BalancedMotions:
    """Balance the first harmonic of the motions of a rig whose interfaces have constant loads.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    joints : sequence of (LawNumbers, Load)
        (i,) laws of parallel elements or of rigid friction, and loads. Rigid friction counts as a stiff element.
    acceleration : float
        Amplitude of the drive [m s-2].
    omega : (k,) array
        Circular frequencies [rad/s].

    Returns
    -------
    BalancedMotions
        The last substitution, whether it has converged or not.
    """
    rows = modes.interfaces
    n = modes.omega.size
    n_laws = len(joints)
    forces = np.vstack([rows, -modes.mass * acceleration * modes.base])
    receptance = compute_receptance(modes, omega, np.eye(n), forces)
    at_interfaces = rows @ receptance
    largest = np.abs(at_interfaces[:, :, n_laws]).max(axis=0)
    laws = [_soften(*joint, size) for joint, size in zip(joints, largest)]
    tables = [_tabulate_stiffness(law, size) for law, size in zip(laws, largest)]

    # U = (I + G K)^-1 d with the receptance G of the interfaces and the slides d without friction
    stiffness = np.tile([law.stiffness + 0j for law in laws], (len(omega), 1))
    # Substitutions of the stiffness, each by half of its change
    for _ in range(60):
        matrix = np.eye(n_laws) + at_interfaces[:, :, :n_laws] * stiffness[:, None]
        slides = np.linalg.solve(matrix, at_interfaces[:, :, n_laws:])[:, :, 0]
        change = -stiffness
        for i, table in enumerate(tables):
            change[:, i] += table.find_stiffness(np.abs(slides[:, i]))
        stiffness += 0.5 * change
        # Relative change of all stiffnesses at which the substitutions end
        if np.abs(change).max() <= 1e-3 * np.abs(stiffness).max():
            break
    loads = np.column_stack([-stiffness * slides, np.ones(len(omega))])
    return BalancedMotions(omega, (receptance @ loads[:, :, None])[:, :, 0], slides)


def _soften(law: LawNumbers, load: Load, largest: float) -> LawNumbers:
    """Return an element in place of rigid friction under a load, which sticks below a part of the largest slide [m]."""
    if law.law == "masing":
        return law
    # Stretch of the element that stands for rigid friction, relative to the slide without friction
    length = 1e-2 * largest
    return masing.from_elements([law.numbers[1] * load.mean / length], [length])


class _StiffnessTable(NamedTuple):
    """First harmonic of a friction force over the amplitude of the slide.

    - amplitudes: (a,) increasing amplitudes [m]
    - moments: (a,) complex force times amplitude [N m], whose imaginary part is the loss per cycle over pi
    - at_rest: tangent stiffness at rest [N/m]
    """

    amplitudes: np.ndarray
    moments: np.ndarray
    at_rest: float

    def find_stiffness(self, amplitude) -> np.ndarray:
        """Return the complex stiffness (k,) [N/m] at amplitudes (k,) [m]."""
        moments = np.interp(amplitude, self.amplitudes, self.moments)
        square = np.maximum(amplitude, self.amplitudes[0]) ** 2
        return np.where(amplitude < self.amplitudes[0], self.at_rest, moments / square)


def _tabulate_stiffness(law: LawNumbers, largest: float) -> _StiffnessTable:
    """Return the first harmonic of the force of a law up to an amplitude [m] that no slide exceeds by much.

    From the reversal at the amplitude u the force is F(u) - 2 F(x), where F is that of first loading and x half of the way.
    """
    numbers = np.array(law.numbers)
    last = max(2 * largest, 10 * law.length)
    # Smallest amplitude of this table, relative to the stretch before slip
    amplitudes = np.geomspace(1e-2 * law.length, last, N_AMPLITUDES)
    nodes, weights = np.polynomial.legendre.leggauss(N_NODES)
    angle = (nodes + 1) * np.pi / 2
    way = amplitudes[:, None] * np.sin(angle / 2) ** 2
    branch = masing.load_first(numbers, way) @ (weights * np.exp(-1j * angle))
    force = -4j / np.pi * masing.load_first(numbers, amplitudes) - 2 * branch
    return _StiffnessTable(amplitudes, force * amplitudes, law.stiffness)
