"""Frictionless contact of two periodic half planes, in waves along the interface: a second, independent solver.

Find p >= 0 with w = g - closing + u >= 0, p . w = 0 and a given mean of p, where each wave of the pressure sinks the
faces on its own, u_k = C(k) p_k. C is handed in, the sum over both bodies (`contact_forms.layered_compliance` of
coated ones). No mesh, no far face and no free edge are in it.

Method: constrained conjugate gradients of Polonsky and Keer (Wear 231, 1999, 206), two pairs of transforms per
iteration, memory of a few arrays.
"""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.fft import irfft, rfft

from patchfem.core import NotConverged, PatchfemError, frozen_array

LIMIT = 1e-9  # largest relative residual that still counts as solved


@dataclass(frozen=True, eq=False, slots=True)
class PeriodicContact:
    """Solution of one period of a wavy contact.

    pressure: (n,) [Pa], >= 0; gap: (n,) [m] after closing, >= 0; closing [m] of the mean planes; residuals: relative,
    recomputed from the definition.
    """

    pressure: np.ndarray
    gap: np.ndarray
    closing: float
    iterations: int
    residuals: MappingProxyType


def wave_numbers(points: int, length: float) -> np.ndarray:
    """Return the wave numbers k (points//2 + 1,) [1/m], from 0, of a period `length` [m] with `points` equal intervals."""
    return 2 * np.pi * np.arange(points // 2 + 1) / length


def residuals(compliance_k, gap, pressure, closing: float, mean: float) -> MappingProxyType:
    """Return the relative residuals of a solution: load, tension, penetration and complementarity.

    Depths are measured in what the pressure itself moves, not in the height of the gap.

    Parameters
    ----------
    compliance_k : (n//2 + 1,) array
        [m/Pa]
    gap, pressure : (n,) array
        [m], [Pa]
    closing : float
        [m]
    mean : float
        Pressure of the load [Pa].
    """
    sunk = np.fft.irfft(np.asarray(compliance_k) * np.fft.rfft(pressure), gap.size)
    opening = gap - closing + sunk
    depth = np.ptp(sunk) + mean * np.max(compliance_k[1:])
    out = {
        "load": abs(pressure.mean() - mean) / mean,
        "tension": max(0.0, -pressure.min()) / mean,
        "penetration": max(0.0, -opening.min()) / depth,
        "complementarity": np.abs(pressure * opening).mean() / (mean * depth),
    }
    return MappingProxyType({key: float(value) for key, value in out.items()})


def _check_arguments(compliance_k, gap, length: float, load: float) -> tuple:
    gap = np.asarray(gap, float)
    compliance_k = np.asarray(compliance_k, float)
    if gap.ndim != 1 or gap.size < 4 or not np.isfinite(gap).all():
        raise PatchfemError("contact: the gap must be a row of at least 4 finite heights")
    if compliance_k.shape != (gap.size // 2 + 1,):
        raise PatchfemError(
            f"contact: {gap.size} points have {gap.size // 2 + 1} waves, "
            f"the compliance has {compliance_k.size}; see wave_numbers"
        )
    if not (
        np.isfinite(compliance_k).all() and compliance_k[0] >= 0 and (compliance_k[1:] > 0).all()
    ):
        raise PatchfemError(
            "contact: the compliance must be finite, positive for every wave and >= 0 for k = 0; "
            "a half plane has none for k = 0: give 0 there"
        )
    if not (np.isfinite(load) and load > 0 and length > 0):
        raise PatchfemError(
            f"contact.load: load ({load:.6g} N/m) and length ({length:.6g} m) must be positive"
        )
    return compliance_k, gap, load / length


def press_periodic(
    compliance_k,
    gap,
    length: float,
    load: float,
    limit: int | None = None,
    tolerance: float = 1e-11,
) -> PeriodicContact:
    """Solve the contact of a period `length` [m] under `load` per width [N/m] with the gap (n,) [m] at equidistant points.

    compliance_k (n//2 + 1,) [m/Pa]: displacement per pressure of each wave of `wave_numbers(n, length)`, both bodies
    together. The entry for k = 0 only moves the whole face: with 0 there (half planes, whose own is infinite)
    `closing` is the mean gap closed, mean(gap before) - mean(gap after); with the compression of finite bodies it
    contains that too. Pressure and gap do not depend on it. Cost: 1 to 4 sqrt(n) iterations, 10 sqrt(n) seen
    at worst, each two pairs of transforms. PatchfemError for arguments without a meaning, NotConverged when a residual
    exceeds 1e-9 after `limit` iterations (50 sqrt(n) + 1000 unless given).
    """
    compliance_k, gap, mean = _check_arguments(compliance_k, gap, length, load)
    limit = int(50 * np.sqrt(gap.size) + 1000) if limit is None else limit
    waves = compliance_k.copy()
    waves[0] = 0.0  # a uniform motion changes no gap difference; it is added to the closing below
    # subtracted, because a light load may close the gap by less than the round-off of the heights
    first = float(gap.min())
    pressure, closing, count = _polonsky_keer(waves, gap - first, mean, limit, tolerance)
    checks = residuals(waves, gap - first, pressure, closing, mean)
    if not all(value <= LIMIT for value in checks.values()):  # written so that NaN also raises
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(
            f"contact: {worst} {checks[worst]:.2e} exceeds {LIMIT:.0e} after {count} iterations; "
            "take fewer points or a rounder gap"
        )
    opening = (gap - first) - closing + irfft(waves * rfft(pressure), gap.size)
    opening[pressure > 0] = 0.0
    closing += first + mean * float(compliance_k[0])
    return PeriodicContact(
        frozen_array(pressure), frozen_array(np.maximum(opening, 0.0)), closing, count, checks
    )


def _polonsky_keer(waves, gap, mean: float, limit: int, tolerance: float) -> tuple:
    """Return pressure (n,) [Pa], closing [m] and number of iterations by the method of Polonsky and Keer.

    The first entry of `waves` must be 0.
    """
    n = gap.size
    pressure = np.full(n, mean)
    direction = np.zeros(n)
    sunk = None
    # `own` is the displacement of a point under its own pressure
    old = 0.0
    own = irfft(waves, n)[0]
    for count in range(1, limit + 1):
        carried = sunk is not None
        if not carried:
            sunk = irfft(waves * rfft(pressure), n)
        opening = gap + sunk
        touching = pressure > 0
        closing = opening[touching].mean()
        opening -= closing
        depth = np.ptp(sunk) + mean * waves[1]
        if max(np.abs(opening[touching]).max(), -opening.min()) <= tolerance * depth:
            if not carried:
                return pressure, float(closing), count
            # convergence is confirmed with displacements computed again from the pressure
            sunk = None
            old = 0.0
            continue
        size = opening[touching] @ opening[touching]
        direction = np.where(touching, opening + (size / old if old > 0 else 0.0) * direction, 0.0)
        answer = irfft(waves * rfft(direction), n)
        bend = (answer[touching] - answer[touching].mean()) @ direction[touching]
        if not bend > 0 and opening.min() >= 0:  # only round-off is left
            return pressure, float(closing), count
        # a single contact point gives no direction, so neighbours enter by their own compliance
        step = (opening[touching] @ direction[touching]) / bend if bend > 0 else 1 / own
        pressure = pressure - step * direction
        clipped = pressure.min() < 0
        if clipped:
            np.maximum(pressure, 0.0, out=pressure)
        entering = (pressure == 0) & (opening < 0)
        enters = entering.any()
        # directions are conjugate for a fixed set of contact points only
        old = 0.0 if enters else size
        if enters:
            pressure[entering] -= step * opening[entering]
        scale = mean / pressure.mean()
        pressure *= scale
        # updated along the direction, and computed again every 50 steps, since round-off accumulates
        sunk = None if clipped or enters or count % 50 == 0 else (sunk - step * answer) * scale
    return pressure, float(closing), limit
