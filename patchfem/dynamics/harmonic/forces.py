"""Harmonics of the forces of friction laws, and their derivatives (alternating frequency and time)."""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...friction.protocol import Element
from .laws import MAX_SAMPLES_PER_CYCLE, Jenkins, LawForce, make_law
from .series import find_harmonics
from .slides import Slides, make_slides

MIN_HARMONIC_SAMPLES = 256  # smallest number of samples per cycle
SAMPLES_PER_HARMONIC = 12


class ForceHarmonics(NamedTuple):
    """Harmonics of the contact forces, and their derivatives.

    - force: (i, H + 1) [N]
    - slope: (i, H + 1, 2 H + 1) derivatives by Re q_0..Re q_H, Im q_1..Im q_H of the same interface [N/m]
    - by_omega: (i, H + 1) [N s]
    """

    force: np.ndarray
    slope: np.ndarray
    by_omega: np.ndarray


class LawGroup:
    """Friction laws and springs on interface rows of a modal basis.

    `parts` is a law, a pair (row, law) or a list of them. A row is the number of an interface of `modes`, or
    participations (n,). A law alone acts on interface 0. An Element is converted to its law, and None means bonds that
    are no single element.

    - modes: the modal basis
    - parts: pairs (row, law)
    - rows (i, n): participations of the interfaces in the modes
    - laws: the laws of each row
    """

    def __init__(self, modes, parts):
        self.modes = modes
        self.parts = []
        rows = {}
        laws = {}
        for part in parts if isinstance(parts, list) else [parts]:
            is_pair = isinstance(part, tuple) and not isinstance(part, Element)
            row, law = part if is_pair else (0, part)
            law = make_law(law) if law is None or isinstance(law, Element) else law
            self.parts.append((row, law))

            # Equal rows and equal numbers share a key, as their laws act side by side on one slide.
            if np.ndim(row):
                vector = np.asarray(row, float)
                key = vector.tobytes()
            else:
                vector = modes.interfaces[row]
                key = int(row)

            rows[key] = vector
            laws.setdefault(key, []).append(law)

        if not rows:
            raise PatchfemError("harmonic balance needs a friction law on at least one interface")
        self.rows = frozen_array(np.array(list(rows.values())))
        self.laws = [tuple(group) for group in laws.values()]

    def with_elements(self, change) -> "LawGroup":
        """Return a copy with other elastic-plastic elements.

        `change` is a function of stiffness (t,) [N/m] and yield slide (t,) [m] that returns both for the new elements.
        """
        parts = []
        for row, law in self.parts:
            if isinstance(law, Jenkins):
                law = Jenkins(*change(law.stiffness, law.limit_slide))
            parts.append((row, law))
        return LawGroup(self.modes, parts)

    def samples_for(self, harmonics: int, amplitudes=None) -> int:
        """Return the number of samples per cycle, a power of two, that resolves harmonics and corners of the forces.

        Only corners alias, so a law is weighted by the square root of its share of all corners.

        Parameters
        ----------
        harmonics : int
            Number of harmonics that are to be resolved.
        amplitudes : (i,) array, optional
            Amplitudes of the slides [m]; without them the corners are not resolved.
        """
        samples = max(MIN_HARMONIC_SAMPLES, SAMPLES_PER_HARMONIC * harmonics)
        corners = [
            (law.total * amplitude, law.count_samples(amplitude))
            for amplitude, laws in zip([] if amplitudes is None else amplitudes, self.laws)
            for law in laws
        ]
        total = sum(size for size, count in corners if count)
        for size, count in corners:
            if count and total > 0:
                samples = max(samples, count * np.sqrt(size / total))
        return int(min(2 ** int(np.ceil(np.log2(samples))), MAX_SAMPLES_PER_CYCLE))

    def stiffness(self) -> np.ndarray:
        """Return the tangent stiffness at rest (i,) [N/m] of each interface row."""
        return np.array([sum(law.total for law in laws) for laws in self.laws])

    def evaluate(self, slides: Slides) -> list[list[LawForce]]:
        """Return the `LawForce` of every law of every row."""
        return [[law.evaluate(slides, i) for law in laws] for i, laws in enumerate(self.laws)]

    def compute_forces(self, q, omega: float, samples: int) -> np.ndarray:
        """Return the forces (i, N) [N] at equal samples of a cycle.

        Parameters
        ----------
        q : (i, H + 1) array
            Harmonics of the slides [m].
        omega : float
            [rad/s].
        samples : int
            Samples per cycle.
        """
        slides = make_slides(q, omega, samples)
        forces = [sum(law.force for law in row) for row in self.evaluate(slides)]
        return np.array(forces)[:, slides.is_sample]

    def compute_harmonics(self, q, omega: float, samples: int) -> ForceHarmonics:
        """Return the harmonics of the forces for harmonics q (i, H + 1) [m] of the slides.

        Parameters
        ----------
        q : (i, H + 1) array
            Harmonics of the slides [m].
        omega : float
            [rad/s].
        samples : int
            Samples per cycle.
        """
        slides = make_slides(q, omega, samples)
        rows = [
            self._differentiate_row(slides, i, forces)
            for i, forces in enumerate(self.evaluate(slides))
        ]
        return ForceHarmonics(*map(np.array, zip(*rows)))

    def _differentiate_row(self, slides: Slides, i: int, forces: list[LawForce]) -> ForceHarmonics:
        """Return the harmonics (H + 1,) of the force of a row, and their derivatives.

        A local stiffness K(theta) enters by its harmonics up to 2 H, a reversal by the harmonics of its stiffness and
        the waves at its angle. `slides` is the sampled motion of all interfaces, `i` the row, and `forces` are those of
        the laws of this row, in their order.
        """
        h = slides.harmonics.shape[1] - 1
        force, slope, holds = (
            sum(getattr(law_force, name) for law_force in forces)
            for name in ("force", "slope", "holds")
        )
        sampled = [force, slope + 0 * force, *np.atleast_2d(holds + 0 * force)]
        x = find_harmonics(np.array(sampled)[:, slides.is_sample], 2 * h)
        jacobian = find_local_jacobian(x[1])
        by_omega = np.zeros(h + 1, complex)

        if np.ndim(holds):
            phase = np.outer(slides.angle[slides.reversals[i]], np.arange(h + 1))
            waves = np.concatenate([np.cos(phase), -np.sin(phase[:, 1:])], axis=1)
            jacobian += x[2:, : h + 1].T @ waves
        for law, law_force in zip(self.laws[i], forces):
            if law_force.states is not None:
                by_slide, by_frequency = law.differentiate(slides, i, law_force.states)
                jacobian += by_slide
                by_omega = by_omega + by_frequency
        return ForceHarmonics(x[0, : h + 1], jacobian, by_omega)


def find_local_jacobian(stiffness) -> np.ndarray:
    """Return the derivatives (H + 1, 2 H + 1) of the harmonics of a force K(theta) q(theta) by those of q.

    `stiffness` (2 H + 1,) are the harmonics of K.
    """
    h = stiffness.size // 2
    # Coefficients of exp(i m theta), m = -2 H..2 H.
    coefficients = np.concatenate([stiffness[:0:-1].conj() / 2, stiffness[:1], stiffness[1:] / 2])
    k = np.arange(h + 1)
    difference = coefficients[np.subtract.outer(k, k) + 2 * h]
    total = coefficients[np.add.outer(k, k) + 2 * h]
    jacobian = np.concatenate([difference + total, 1j * (difference - total)[:, 1:]], axis=1)
    jacobian[:, 0] = stiffness[: h + 1]
    jacobian[0] = jacobian[0].real
    jacobian[0, 1:] /= 2
    return jacobian
