"""Harmonics of friction forces by the alternating frequency-time method."""

from functools import lru_cache

import numpy as np

from ...core import PatchfemError, frozen_array
from ...friction.protocol import Element
from .harmonic import ContactResponse
from .laws import Jenkins, SampledSlide, evaluate_series, find_harmonics, make_law

# Smallest number of samples per cycle.
# Largest number of samples per cycle.
MIN_SAMPLES = 256
MAX_SAMPLES = 65536


class LawGroup:
    """Friction laws and springs that act on the interface rows of a modal basis.

    `parts` is a law, a pair (row, law) or a list of them. A row is the number of an interface of
    `modes` or participations (n,); a law alone acts on interface 0. An Element is converted to its
    law; None means bonds that are no single element.
    rows: (i, n); laws: a tuple of laws for every row; modes: the modal basis.
    A call with the harmonics (i, H + 1) of the slides and omega returns a
    `harmonic.ContactResponse`.
    """

    def __init__(self, modes, parts, samples: int = 0):
        rows = {}
        laws = {}
        for part in parts if isinstance(parts, list) else [parts]:
            is_pair = isinstance(part, tuple) and not isinstance(part, Element)
            row, law = part if is_pair else (0, part)
            law = make_law(law) if law is None or isinstance(law, Element) else law
            faces = modes.interfaces
            if np.ndim(row) == 0 and not 0 <= row < len(faces):
                raise PatchfemError(
                    f"there is no interface {row}; the rig has {len(faces)} interfaces, counted from 0"
                )
            vector = faces[row] if np.ndim(row) == 0 else np.asarray(row, float)
            key = vector.tobytes() if np.ndim(row) else int(row)
            rows[key] = vector
            laws.setdefault(key, []).append(law)
        if not rows:
            raise PatchfemError("harmonic balance needs a friction law on at least one interface")
        self.modes = modes
        self.rows = frozen_array(np.array(list(rows.values())))
        self.laws = [tuple(v) for v in laws.values()]
        self.samples = samples

    def with_samples(self, samples: int) -> "LawGroup":
        """Return a copy with a different number of samples per cycle."""
        copy = object.__new__(LawGroup)
        copy.modes = self.modes
        copy.rows = self.rows
        copy.laws = self.laws
        copy.samples = samples
        return copy

    def with_elements(self, change) -> "LawGroup":
        """Return a copy in which the elastic-plastic elements are replaced.

        change: function of stiffness (t,) [N/m] and yield slide (t,) [m] that returns both of the new elements.
        """
        copy = self.with_samples(self.samples)

        def replace_elements(law):
            """Return a law with replaced elements, or the law itself if it has none."""
            if isinstance(law, Jenkins):
                return Jenkins(*change(law.stiffness, law.limit_slide))
            return law

        copy.laws = [tuple(map(replace_elements, laws)) for laws in self.laws]
        return copy

    def samples_for(self, harmonics: int, amplitudes=None) -> int:
        """Return the number of samples per cycle needed to resolve the harmonics and stick phases.

        The number is a power of two. amplitudes: (i,) amplitudes of the slides [m].

        Only the corners of a force alias, so a law is weighted by the square root of its fraction of all
        corners.
        """
        samples = max(MIN_SAMPLES, 12 * harmonics)
        corners = []
        if amplitudes is not None:
            for amplitude, laws in zip(amplitudes, self.laws):
                for law in laws:
                    if n_samples := law.count_samples(amplitude):
                        corners.append((law.total * amplitude, n_samples))
        total = sum(size for size, _ in corners)
        if total > 0:
            for size, n_samples in corners:
                samples = max(samples, n_samples * np.sqrt(size / total))
        return int(min(2 ** int(np.ceil(np.log2(samples))), MAX_SAMPLES))

    def stiffness(self) -> np.ndarray:
        """Return the total tangent stiffness at rest (i,) [N/m] for each interface row."""
        return np.array([sum(law.total for law in laws) for laws in self.laws])

    def sample_slides(self, q, omega: float, samples: int = 0) -> list:
        """Sample the relative displacement of each interface row over a cycle.

        Parameters
        ----------
        q : ndarray
            (i, H + 1) harmonics of the slides [m].
        omega : float
            Frequency of the drive [rad/s].
        samples : int, optional
            Samples per cycle; 0 for the number of the group, or as many as H needs.

        Returns
        -------
        list of SampledSlide
        """
        n = samples or self.samples or self.samples_for(q.shape[1] - 1)
        values = evaluate_series(q, n)
        rates = evaluate_series(1j * np.arange(q.shape[1]) * q, n)
        return [SampledSlide(x, omega, n, v, r) for x, v, r in zip(q, values, rates)]

    def compute_forces(self, q, omega: float, samples: int = 0) -> np.ndarray:
        """Return the friction forces (i, N) [N] of all interface rows at the samples of a cycle.

        Parameters
        ----------
        q : ndarray
            (i, H + 1) harmonics of the slides [m].
        omega : float
        samples : int, optional

        Returns
        -------
        ndarray
        """
        tracks = self.sample_slides(q, omega, samples)
        return np.array(
            [sum(law.sample(track).force for law in laws) for track, laws in zip(tracks, self.laws)]
        )

    def compute_force_harmonics(self, q, omega: float, harmonics: int, samples: int) -> np.ndarray:
        """Compute the harmonics (i, harmonics + 1) of the friction forces [N] for given displacements.

        Parameters
        ----------
        q : ndarray
        omega : float
        harmonics, samples : int

        Returns
        -------
        ndarray
        """
        return find_harmonics(self.compute_forces(q, omega, samples), harmonics)

    def __call__(self, q, omega: float) -> ContactResponse:
        tracks = self.sample_slides(q, omega)
        sampled = [[law.sample(track) for law in laws] for track, laws in zip(tracks, self.laws)]
        return find_response(tracks, sampled)


def find_response(tracks: list, sampled: list) -> ContactResponse:
    """Return the harmonics of sampled friction forces, and the harmonics of their derivatives.

    tracks: SampledSlide of each row; sampled: SampledForces of the laws of each row. The local slope
    K(theta) enters by its harmonics up to 2 H, as a Toeplitz and a Hankel part; a
    reversal by the harmonics of its stiffness and the basis at its angle. One transform serves
    all rows.
    """
    x = np.array([t.x for t in tracks])
    samples = tracks[0].samples
    omega = tracks[0].omega
    rows = len(tracks)
    h = x.shape[1] - 1

    rates = [_sum_laws(laws, "by_rate") for laws in sampled]
    holds = [_sum_laws(laws, "hold") for laws in sampled]
    forces = [_sum_laws(laws, "force") for laws in sampled]
    slopes = [_sum_laws(laws, "slope") for laws in sampled]
    has_rates = any(rate_slopes is not None for rate_slopes in rates)
    sampled_fields = [*forces, *slopes, *(rates if has_rates else ())]
    sampled_fields = [np.zeros(samples) if values is None else values for values in sampled_fields]
    harmonics = find_harmonics(
        np.concatenate([np.array(sampled_fields), *(hold for hold in holds if hold is not None)]),
        2 * h,
    )
    slope = find_local_jacobians(harmonics[rows : 2 * rows])
    rate = np.zeros((rows, h + 1), complex)
    depends_on_omega = has_rates or any(s.tangent is not None for laws in sampled for s in laws)
    first_hold = 2 * rows
    k = np.arange(1, h + 1)

    def derivative_by_omega(jacobians, change):
        """Return the derivative of the forces by omega, given the changes of the harmonics."""
        parts = np.concatenate([np.zeros((rows, 1)), change.real, change.imag], axis=1)
        return np.einsum("ikl,il->ik", jacobians, parts)

    if has_rates:
        jacobians = find_local_jacobians(harmonics[first_hold : first_hold + rows])
        first_hold = first_hold + rows
        slope[..., 1 : h + 1] += jacobians[..., h + 1 :] * (k * omega)
        slope[..., h + 1 :] -= jacobians[..., 1 : h + 1] * (k * omega)
        rate += derivative_by_omega(jacobians, 1j * k * x[:, 1:])
    for i, (track, hold) in enumerate(zip(tracks, holds)):
        if hold is not None and len(hold):
            phase = np.arange(h + 1) * track.turning_points.angles[:, None]
            basis = np.concatenate([np.cos(phase), -np.sin(phase[:, 1:])], axis=1)
            slope[i] += harmonics[first_hold : first_hold + len(hold), : h + 1].T @ basis
            first_hold += len(hold)
    for i, laws in enumerate(sampled):
        for law in laws:
            if law.tangent is not None:
                to_slide, to_omega = law.tangent()
                slope[i] += find_harmonics(to_slide.T, h).T
                rate[i] += find_harmonics(to_omega, h)
    return ContactResponse(harmonics[:rows, : h + 1], slope, rate if depends_on_omega else None)


def _sum_laws(laws: list, name: str) -> np.ndarray | None:
    """Sum one field of SampledForce over all laws on an interface row.

    The result is None if no law has the field. A law with a tangent contributes its force alone.
    """
    total = None
    for sampled in laws:
        values = getattr(sampled, name)
        if values is None or (sampled.tangent is not None and name != "force"):
            continue
        total = values if total is None else total + values
    return total


@lru_cache(maxsize=16)
def _coefficient_positions(h: int) -> tuple:
    """Return positions of the sums and differences of harmonic numbers up to h, (h + 1, h + 1) each."""
    row = np.arange(h + 1)[:, None]
    column = np.arange(h + 1)[None, :]
    return row - column + 2 * h, row + column + 2 * h


def find_local_jacobians(k) -> np.ndarray:
    """Return the Jacobians (i, H + 1, 2 H + 1) of the harmonics for a force K(theta) q(theta).

    k: (i, 2 H + 1) harmonics of the local stiffness K.
    """
    h = k.shape[1] // 2
    # These are the complex Fourier coefficients of exp(i m theta), m = -2 H..2 H.
    coefficients = np.concatenate([k[:, :0:-1].conj() / 2, k[:, :1], k[:, 1:] / 2], axis=1)
    difference_part, sum_part = (
        coefficients[:, positions] for positions in _coefficient_positions(h)
    )
    out = np.empty((len(k), h + 1, 2 * h + 1), complex)
    out[..., : h + 1] = difference_part + sum_part
    out[..., h + 1 :] = 1j * (difference_part - sum_part)[..., 1:]
    out[..., 0] = k[:, : h + 1]
    out[:, 0] = out[:, 0].real
    out[:, 0, 1:] /= 2
    return out
