"""From the harmonics of the slides to those of the forces and back: alternating frequency and time over all rows."""

from functools import lru_cache

import numpy as np

from ...core import PatchfemError, frozen_array
from .harmonic import Fold
from .laws import Jenkins, Track, analysis, law_of_model, synthesis

# samples of a cycle
FEWEST = 256
MOST = 65536


class Group:
    """Laws on rows: a law, a pair (row, law) or a list of them.

    A row is a number of an interface of `modes` or participations (n,) of its own; a law alone sits on interface 0; a
    dynamics.march.march.ContactModel becomes its law.
    rows (i, n), laws: a tuple of laws per row. Calling it with the harmonics (i, H + 1) of the slides and omega gives a
    dynamics.harmonic.Fold.
    """

    def __init__(self, modes, parts, samples: int = 0):
        rows = {}
        laws = {}
        for part in parts if isinstance(parts, list) else [parts]:
            row, law = part if isinstance(part, tuple) else (0, part)
            law = law_of_model(law) if hasattr(law, "fields") else law
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
        self.rows = frozen_array(np.array(list(rows.values())))
        self.laws = [tuple(v) for v in laws.values()]
        self.samples = samples

    def with_samples(self, samples: int) -> "Group":
        """The same laws on the same rows, on a grid of `samples` per cycle."""
        other = object.__new__(Group)
        other.rows = self.rows
        other.laws = self.laws
        other.samples = samples
        return other

    def remade(self, change) -> "Group":
        """The same with other elements: change(stiffness (t,) [N/m], yield slide (t,) [m]) -> both."""
        other = self.with_samples(self.samples)
        other.laws = [
            tuple(
                Jenkins(*change(one.stiffness, one.limit_slide))
                if isinstance(one, Jenkins)
                else one
                for one in laws
            )
            for laws in self.laws
        ]
        return other

    def samples_for(self, harmonics: int, amplitudes=None) -> int:
        """A power of two that holds the products of H harmonics and the sharpest stick at the amplitudes (i,) [m].

        What aliases is the corner of a law, so a law counts by the root of its share of all corners.
        """
        want = max(FEWEST, 12 * harmonics)
        if amplitudes is not None:
            found = [
                (law.total * a, law.sharpness(a))
                for a, laws in zip(amplitudes, self.laws)
                for law in laws
            ]
            whole = sum(corner for corner, sharp in found if sharp)
            want = max(
                [
                    want,
                    *(
                        sharp * np.sqrt(corner / whole)
                        for corner, sharp in found
                        if sharp and whole > 0
                    ),
                ]
            )
        return int(min(2 ** int(np.ceil(np.log2(want))), MOST))

    def stiffness(self) -> np.ndarray:
        """Tangent stiffness of every row at rest (i,) [N/m]."""
        return np.array([sum(law.total for law in laws) for laws in self.laws])

    def tracks(self, q, omega: float, samples: int = 0) -> list:
        """Track of every row, a list of i, from the harmonics q (i, H + 1) [m] of the slides.

        samples: per cycle, 0: those of the group or as many as H asks for.
        """
        n = samples or self.samples or self.samples_for(q.shape[1] - 1)
        values = synthesis(q, n)
        rates = synthesis(1j * np.arange(q.shape[1]) * q, n)
        return [Track(x, omega, n, v, r) for x, v, r in zip(q, values, rates)]

    def forces(self, q, omega: float, samples: int = 0) -> np.ndarray:
        """Forces (i, N) [N] at the samples of one cycle, from the harmonics q (i, H + 1) [m] of the slides."""
        return np.array(
            [
                sum(law.sample(track).force for law in laws)
                for track, laws in zip(self.tracks(q, omega, samples), self.laws)
            ]
        )

    def force(self, q, omega: float, harmonics: int, samples: int) -> np.ndarray:
        """Harmonics (i, harmonics + 1) [N] of the forces from those of the slides, q (i, H + 1) [m]."""
        return analysis(self.forces(q, omega, samples), harmonics)

    def __call__(self, q, omega: float) -> Fold:
        tracks = self.tracks(q, omega)
        return fold(
            tracks, [[law.sample(track) for law in laws] for track, laws in zip(tracks, self.laws)]
        )


def fold(tracks: list, sampled: list) -> Fold:
    """Harmonics of the forces and of their slopes from the laws sampled along the tracks of i rows.

    The local slope K(theta) enters by its harmonics up to 2 H, a Toeplitz and a Hankel part; a turning point s by the
    harmonics of its share and the basis at its angle: no product over the samples, one transform for all rows.
    """
    x = np.array([t.x for t in tracks])
    samples = tracks[0].samples
    omega = tracks[0].omega
    rows = len(tracks)
    h = x.shape[1] - 1

    def added(name):
        return [
            _sum(
                [
                    getattr(s, name)
                    for s in laws
                    if getattr(s, name) is not None and (s.tangent is None or name == "force")
                ]
            )
            for laws in sampled
        ]

    rates = added("by_rate")
    holds = added("hold")
    moving = any(one is not None for one in rates)
    lines = [*added("force"), *added("slope"), *(rates if moving else ())]
    lines = [np.zeros(samples) if line is None else line for line in lines]
    found = analysis(
        np.concatenate([np.array(lines), *(hold for hold in holds if hold is not None)]), 2 * h
    )
    slope = local(found[rows : 2 * rows])
    rate = np.zeros((rows, h + 1), complex)
    turns = moving or any(s.tangent is not None for laws in sampled for s in laws)
    at = 2 * rows
    k = np.arange(1, h + 1)

    def by_omega(turned, change):
        parts = np.concatenate([np.zeros((rows, 1)), change.real, change.imag], axis=1)
        return np.einsum("ikl,il->ik", turned, parts)

    if moving:
        turned = local(found[at : at + rows])
        at = at + rows
        slope[..., 1 : h + 1] += turned[..., h + 1 :] * (k * omega)
        slope[..., h + 1 :] -= turned[..., 1 : h + 1] * (k * omega)
        rate += by_omega(turned, 1j * k * x[:, 1:])
    for i, (track, hold) in enumerate(zip(tracks, holds)):
        if hold is not None and len(hold):
            phase = np.arange(h + 1) * track.turning[0][:, None]
            basis = np.concatenate([np.cos(phase), -np.sin(phase[:, 1:])], axis=1)
            slope[i] += found[at : at + len(hold), : h + 1].T @ basis
            at += len(hold)
    for i, laws in enumerate(sampled):
        for one in laws:
            if one.tangent is not None:
                to_slide, to_omega = one.tangent()
                slope[i] += analysis(to_slide.T, h).T
                rate[i] += analysis(to_omega, h)
    return Fold(found[:rows, : h + 1], slope, rate if turns else None)


def _sum(arrays: list):
    return None if not arrays else arrays[0] if len(arrays) == 1 else sum(arrays)


@lru_cache(maxsize=16)
def _places(h: int) -> tuple:
    row = np.arange(h + 1)[:, None]
    column = np.arange(h + 1)[None, :]
    return row - column + 2 * h, row + column + 2 * h


def local(k) -> np.ndarray:
    """Jacobians (i, H + 1, 2 H + 1) of the harmonics of K(theta) q(theta) to those of q; k (i, 2 H + 1) those of K."""
    h = k.shape[1] // 2
    # of exp(i m theta), m = -2 H..2 H
    two = np.concatenate([k[:, :0:-1].conj() / 2, k[:, :1], k[:, 1:] / 2], axis=1)
    less, more = (two[:, place] for place in _places(h))
    out = np.empty((len(k), h + 1, 2 * h + 1), complex)
    out[..., : h + 1] = less + more
    out[..., h + 1 :] = 1j * (less - more)[..., 1:]
    out[..., 0] = k[:, : h + 1]
    out[:, 0] = out[:, 0].real
    out[:, 0, 1:] /= 2
    return out
