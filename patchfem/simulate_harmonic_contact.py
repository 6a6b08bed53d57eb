"""From the harmonics of the slides to those of the forces and back: alternating frequency and time over all rows."""

import numpy as np

from .core import PatchfemError, frozen_array
from .dynamics.harmonic import Fold
from .simulate_harmonic_laws import Track, analysis, law_of_model, synthesis

FEWEST, MOST = 256, 65536  # samples of a cycle


class Group:
    """Laws on rows: a law, a pair (row, law) or a list of them.

    A row is a number of an interface of `modes` or participations (n,) of its own; a law alone sits on interface 0; a
    simulate_march.ContactModel becomes its law.
    rows (i, n), laws: a tuple of laws per row. Calling it with the harmonics (i, H + 1) of the slides and omega gives a
    dynamics.harmonic.Fold.
    """

    def __init__(self, modes, parts, samples: int = 0):
        rows, laws = {}, {}
        for part in parts if isinstance(parts, list) else [parts]:
            row, law = part if isinstance(part, tuple) else (0, part)
            law = law_of_model(law) if hasattr(law, "fields") else law
            faces = modes.interfaces
            if np.ndim(row) == 0 and not 0 <= row < len(faces):
                raise PatchfemError(f"interface {row}: there are {len(faces)}, counted from 0")
            vector = faces[row] if np.ndim(row) == 0 else np.asarray(row, float)
            key = vector.tobytes() if np.ndim(row) else int(row)
            rows[key] = vector
            laws.setdefault(key, []).append(law)
        if not rows:
            raise PatchfemError("the balance wants at least one law at an interface")
        self.rows, self.laws = frozen_array(np.array(list(rows.values()))), [tuple(v) for v in laws.values()]
        self.samples = samples

    def with_samples(self, samples: int) -> "Group":
        """The same on a grid of `samples`."""
        other = object.__new__(Group)
        other.rows, other.laws, other.samples = self.rows, self.laws, samples
        return other

    def samples_for(self, harmonics: int, amplitudes=None) -> int:
        """A power of two that holds the products of H harmonics and the sharpest stick at the amplitudes (i,) [m].

        What aliases is the corner of a law, so a law counts by the root of its share of all corners.
        """
        want = max(FEWEST, 12 * harmonics)
        if amplitudes is not None:
            found = [(law.total * a, law.sharpness(a)) for a, laws in zip(amplitudes, self.laws) for law in laws]
            whole = sum(corner for corner, sharp in found if sharp)
            want = max([want, *(sharp * np.sqrt(corner / whole) for corner, sharp in found if sharp and whole > 0)])
        return int(min(2 ** int(np.ceil(np.log2(want))), MOST))

    def stiffness(self) -> np.ndarray:
        """Tangent stiffness of every row at rest (i,) [N/m]."""
        return np.array([sum(law.total for law in laws) for laws in self.laws])

    def tracks(self, q, omega: float, samples: int = 0) -> list:
        """Track of every row."""
        n = samples or self.samples or self.samples_for(q.shape[1] - 1)
        values, rates = synthesis(q, n), synthesis(1j * np.arange(q.shape[1]) * q, n)
        return [Track(x, omega, n, v, r) for x, v, r in zip(q, values, rates)]

    def forces(self, q, omega: float, samples: int = 0) -> np.ndarray:
        """Forces (i, N) at the samples of one cycle."""
        return np.array([sum(law.sample(track).force for law in laws)
                         for track, laws in zip(self.tracks(q, omega, samples), self.laws)])

    def force(self, q, omega: float, harmonics: int, samples: int) -> np.ndarray:
        """Harmonics (i, harmonics + 1) of the forces."""
        return analysis(self.forces(q, omega, samples), harmonics)

    def __call__(self, q, omega: float) -> Fold:
        rows, h = len(self.rows), q.shape[1] - 1
        force = np.empty((rows, h + 1), complex)
        slope = np.empty((rows, h + 1, 2 * h + 1), complex)
        rate = None
        for i, (track, laws) in enumerate(zip(self.tracks(q, omega), self.laws)):
            force[i], slope[i], moved = fold(track, [law.sample(track) for law in laws], h)
            if moved is not None:
                rate = np.zeros((rows, h + 1), complex) if rate is None else rate
                rate[i] = moved
        return Fold(force, slope, rate)


def fold(track: Track, sampled: list, harmonics: int) -> tuple:
    """(force (H + 1,), slope (H + 1, 2 H + 1), d force/d omega (H + 1,) or None) of the laws of one row.

    The local slope K(theta) enters by its harmonics up to 2 H, a Toeplitz and a Hankel part; a turning point s by the
    harmonics of its share and the basis at its angle: no product over the samples.
    """
    h = harmonics
    slopes = [s.slope for s in sampled if s.slope is not None]
    rates = [s.by_rate for s in sampled if s.by_rate is not None]
    holds = [s.hold for s in sampled if s.hold is not None]
    lines = [sum(s.force for s in sampled)[None]]
    lines += [sum(slopes)[None]] if slopes else []
    lines += [sum(rates)[None]] if rates else []
    lines += [sum(holds)] if holds else []
    found = analysis(np.concatenate(lines), 2 * h)
    at, slope, moved = 1, np.zeros((h + 1, 2 * h + 1), complex), None
    if slopes:
        slope += local(found[at])
        at += 1
    if rates:
        turned = local(found[at])
        k = np.arange(h + 1) * track.omega
        slope[:, 1:h + 1] += turned[:, h + 1:] * k[1:]
        slope[:, h + 1:] -= turned[:, 1:h + 1] * k[1:]
        moved = turned @ np.concatenate([np.zeros(1), (1j * np.arange(1, h + 1) * track.x[1:]).real,
                                         (1j * np.arange(1, h + 1) * track.x[1:]).imag])
        at += 1
    if holds and len(holds[0]):
        phase = np.arange(h + 1) * track.turning[0][:, None]
        basis = np.concatenate([np.cos(phase), -np.sin(phase[:, 1:])], axis=1)
        slope += found[at:, :h + 1].T @ basis
    return found[0, :h + 1], slope, moved


def local(k) -> np.ndarray:
    """Jacobian (H + 1, 2 H + 1) of the harmonics of K(theta) q(theta) to those of q; k (2 H + 1,) harmonics of K."""
    h = k.size // 2
    two = np.concatenate([k[:0:-1].conj() / 2, [k[0]], k[1:] / 2])  # of exp(i m theta), m = -2 H..2 H
    row, column = np.arange(h + 1)[:, None], np.arange(h + 1)[None, :]
    less, more = two[row - column + 2 * h], two[row + column + 2 * h]
    out = np.concatenate([less + more, 1j * (less - more)[:, 1:]], axis=1)
    out[:, 0] = k[:h + 1]
    out[0] = out[0].real / [1.0, *[2.0] * (2 * h)]
    return out
