"""Balance of the odd harmonics of a driven rig, an estimate from which periodic motions are found.

With slides u = Im(sum of U_h exp(i h omega t)) over odd h, the friction of parallel elements has harmonics F_h, and the
modes move as those of a linear rig under drive and friction. Newton's method balances them, with the friction of the
elements at samples of half a period (alternating frequency-time method: Cameron and Griffin, J. Appl. Mech. 56, 149, 1989).
"""

from typing import NamedTuple

import numpy as np

from .. import kernel_cache
from ..core import ModalBasis
from ..structure.response import compute_receptance
from .cases import Case, Load, make_arrays
from .laws import LAWS, masing
from .records import Balance, BalancedLaws, BalanceWork, Face, LawNumbers, Memory, Setting, State

N_SMOOTH_ELEMENTS = 12  # elements in place of a smooth curve of first loading
HARMONICS = np.array([1, 3, 5, 7, 9])  # harmonics that are balanced
# Samples of half a period, over which odd harmonics are orthogonal
PHASES = np.arange(64) * np.pi / 64
WAVES = np.hstack([np.sin(np.outer(PHASES, HARMONICS)), np.cos(np.outer(PHASES, HARMONICS))])


class BalancedMotions(NamedTuple):
    """Odd harmonics of the motions of a rig at k frequencies, as complex amplitudes.

    - omega: (k,) increasing circular frequencies [rad/s]
    - modes: (k, n, h) modal coordinates [m]
    - slides: (k, i, h) relative displacements of the interfaces [m]
    - heights: (k,) half the ranges of the motion at a point [m]; inf where the harmonics are not balanced
    """

    omega: np.ndarray
    modes: np.ndarray
    slides: np.ndarray
    heights: np.ndarray

    def make_start(self, case: Case) -> State:
        """Return the state at the start of a period of a case at the first frequency.

        Elements remember the loop between both reversals of the slide.
        """
        state = make_arrays(case)[0]
        modes = self.modes[0]
        n = len(modes)
        state.y[:n] = modes.sum(axis=1).imag
        state.y[n : 2 * n] = case.rig.settings[Setting.OMEGA] * (modes.real @ HARMONICS)
        samples = _sample(self.slides[0])
        speeds = self.slides[0].real @ HARMONICS

        # Both reversals of each interface
        for face, memory, slide, speed in zip(case.rig.faces, state.memory, samples, speeds):
            if LAWS[int(face[Face.LAW])] != "masing":
                continue
            memory[Memory.COUNT] = 0
            memory[Memory.DIRECTION] = 1.0 if speed >= 0 else -1.0
            ends = np.array([-1.0, 1.0]) * np.abs(slide).max()
            masing.remember_loop(face[Face.NUMBERS :], memory, ends, slide[0])
        return state


def _sample(harmonics) -> np.ndarray:
    """Return the values (..., s) at the samples of half a period from complex amplitudes (..., h)."""
    return np.concatenate([harmonics.real, harmonics.imag], axis=-1) @ WAVES.T


class _LinearRig(NamedTuple):
    """Rig without friction at k frequencies and their harmonics.

    - receptance: (k, h, n, i) modal coordinates per force at the interfaces [m/N]
    - driven: (k, n) modal coordinates under the drive, in the first harmonic [m]
    - rows: (i, n) slides per modal coordinate
    """

    receptance: np.ndarray
    driven: np.ndarray
    rows: np.ndarray

    def find_modes(self, forces) -> np.ndarray:
        """Return the modal coordinates (k, n, h) [m] under the drive and friction forces (k, i, h) [N]."""
        motion = -np.einsum("khni,kih->knh", self.receptance, forces)
        motion[:, :, 0] += self.driven
        return motion

    def select(self, places) -> "_LinearRig":
        """Return the rig at some of its frequencies, from their indices."""
        return self._replace(receptance=self.receptance[places], driven=self.driven[places])


def _make_linear_rig(modes: ModalBasis, omega, acceleration: float) -> _LinearRig:
    """Return a rig without friction under a drive of an amplitude [m s-2] at frequencies (k,) [rad/s]."""
    forces = np.vstack([modes.interfaces, -modes.mass * acceleration * modes.base])
    n = modes.omega.size
    receptance = compute_receptance(modes, np.outer(omega, HARMONICS).ravel(), np.eye(n), forces)
    receptance = receptance.reshape(omega.size, HARMONICS.size, n, len(forces))
    return _LinearRig(receptance[..., :-1], receptance[:, 0, :, -1], modes.interfaces)


class HarmonicBalance:
    """Balance of the odd harmonics of the motions of a rig whose interfaces have constant loads.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    joints : sequence of (LawNumbers, Load)
        (i,) laws of parallel elements or of rigid friction, and loads. Rigid friction counts as a stiff element.
    acceleration : float
        Amplitude of the drive [m s-2].
    row : (n,) array
        Participations of the modes in the motion of the point whose heights are wanted.
    """

    def __init__(self, modes: ModalBasis, joints, acceleration: float, row):
        self.modes = modes
        self.joints = joints
        self.acceleration = acceleration
        self.row = row

    def find_curve(self, omega) -> BalancedMotions:
        """Return the motions at increasing frequencies (k,) [rad/s], which are found from those of sticking interfaces."""
        rig = _make_linear_rig(self.modes, omega, self.acceleration)
        largest = np.abs(rig.driven @ rig.rows.T).max(axis=0)
        self.laws = [_soften(*joint, size) for joint, size in zip(self.joints, largest)]

        # U = (I + G K)^-1 d with the receptance G and the stiffness K of the interfaces and the slides d without friction
        slides = np.zeros((omega.size, len(self.laws), HARMONICS.size), complex)
        stiffness = np.diag([law.stiffness for law in self.laws])
        matrix = np.eye(len(self.laws)) + rig.rows @ rig.receptance[:, 0] @ stiffness
        driven = (rig.driven @ rig.rows.T)[:, :, None]
        slides[:, :, 0] = np.linalg.solve(matrix, driven)[:, :, 0]
        return self._balance(omega, rig, slides)

    def find_near(self, omega: float, near: BalancedMotions) -> BalancedMotions:
        """Return the motion at a frequency [rad/s], which is found from others."""
        rig = _make_linear_rig(self.modes, np.array([omega]), self.acceleration)
        slides = np.empty((1, *near.slides.shape[1:]), complex)
        for place in np.ndindex(slides.shape[1:]):
            slides[(0, *place)] = np.interp(omega, near.omega, near.slides[(..., *place)])
        return self._balance(np.array([omega]), rig, slides)

    def _balance(self, omega, rig: _LinearRig, slides) -> BalancedMotions:
        """Balance all harmonics at frequencies (k,) [rad/s] from slides (k, i, h) [m]."""
        lengths, stiffness = zip(*map(_list_elements, self.laws))
        counts = [own.size for own in lengths]
        driven = np.zeros(slides.shape, complex)
        driven[:, :, 0] = rig.driven @ rig.rows.T

        # Arrays of the compiled search
        n_samples, n_waves = WAVES.shape
        size = n_waves * len(self.laws)
        laws = BalancedLaws(
            WAVES,
            np.append(0, np.cumsum(counts)),
            np.concatenate(lengths),
            np.concatenate(stiffness),
        )
        work = BalanceWork(
            path=np.zeros(n_samples),
            friction=np.zeros(n_samples),
            follows=np.zeros((n_samples, n_waves)),
            slopes=np.zeros((n_waves, size)),
            matrix=np.zeros((size, size + 1)),
            motions=np.zeros((3, size)),
        )
        balance = Balance(
            receptance=_separate_matrix(rig.rows @ rig.receptance),
            driven=_separate(driven),
            slides=_separate(slides),
            forces=np.zeros((omega.size, size)),
            is_balanced=np.zeros(omega.size),
            laws=laws,
            work=work,
        )
        kernel_cache.load_compiled_module("event_driven.balance_kernels").balance_curve(balance)

        motion = rig.find_modes(_join(balance.forces))
        heights = np.abs(_sample(self.row @ motion)).max(axis=-1)
        heights[balance.is_balanced == 0] = np.inf
        return BalancedMotions(omega, motion, _join(balance.slides), heights)


def _separate(harmonics) -> np.ndarray:
    """Return the real and the imaginary parts (k, i 2 h) of the harmonics (k, i, h) of each interface in a row."""
    parts = np.concatenate([harmonics.real, harmonics.imag], axis=2)
    return parts.reshape(len(harmonics), -1)


def _join(parts) -> np.ndarray:
    """Return the harmonics (k, i, h) of the real and the imaginary parts (k, i 2 h) of `_separate`."""
    real, imaginary = np.moveaxis(parts.reshape(len(parts), -1, 2, HARMONICS.size), 2, 0)
    return real + 1j * imaginary


def _separate_matrix(receptance) -> np.ndarray:
    """Return the real matrices (k, i 2 h, i 2 h) that multiply parts as receptances (k, h, i, i) multiply harmonics."""
    n_omega, n_harmonics, n_faces = receptance.shape[:3]
    matrix = np.zeros((n_omega, n_faces, 2, n_harmonics, n_faces, 2, n_harmonics))
    for k in range(n_harmonics):
        own = receptance[:, k]
        for row, column, part in (
            (0, 0, own.real),
            (0, 1, -own.imag),
            (1, 0, own.imag),
            (1, 1, own.real),
        ):
            matrix[:, :, row, k, :, column, k] = part
    return matrix.reshape(n_omega, n_faces * 2 * n_harmonics, -1)


def _list_elements(law: LawNumbers) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest stretch [m] and the stiffness [N/m] (e,) of the elements of a law of `masing`.

    A smooth curve of first loading has N_SMOOTH_ELEMENTS in its place.
    """
    if not masing.has_power_law(law):
        return masing.list_elements(law)[::-1]
    # Points of the curve, which is most bent at its start
    points = law.numbers[3] * np.linspace(0.0, 1.0, N_SMOOTH_ELEMENTS + 1) ** 2
    slopes = np.diff(masing.load_first(np.array(law.numbers), points)) / np.diff(points)
    return points[1:], -np.diff(np.append(slopes, 0.0))


def _soften(law: LawNumbers, load: Load, largest: float) -> LawNumbers:
    """Return an element in place of rigid friction under a load, which sticks below a part of the largest slide [m]."""
    if law.law == "masing":
        return law
    # Stretch of the element that stands for rigid friction, relative to the slide without friction
    length = 1e-2 * largest
    return masing.from_elements([law.numbers[1] * load.mean / length], [length])
