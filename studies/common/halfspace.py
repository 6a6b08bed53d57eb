"""Frictionless contact of two periodic half planes, in waves along the interface: a second, independent solver.

Find p >= 0 with w = g - closing + u >= 0, p . w = 0 and a given mean of p, where each wave of the pressure sinks the
faces on its own, u_k = C(k) p_k. C is handed in, the sum over both bodies (`contact_forms.layered_compliance` of
coated ones). No mesh, no far face and no free edge are in it.

Method: constrained conjugate gradients of Polonsky and Keer (Wear 231, 1999, 206), two pairs of transforms per
iteration, memory of a few arrays.
"""

from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, rfft

from patchfem.core import NotConverged

TOLERANCE = 1e-11  # gap on the contact at which the iteration ends, as `LIMIT`
LIMIT = 1e-9  # largest relative residual that still counts as solved


class PeriodicContact(NamedTuple):
    """Solution of one period of a wavy contact.

    pressure: (n,) [Pa], >= 0; gap: (n,) [m] after closing, >= 0; closing [m] of the mean planes.
    """

    pressure: np.ndarray
    gap: np.ndarray
    closing: float


def find_residual(compliance_k, gap, pressure, closing: float, mean: float) -> float:
    """Return the largest relative residual of a solution: of load, tension, penetration and complementarity.

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
    sunk = np.fft.irfft(compliance_k * np.fft.rfft(pressure), gap.size)
    opening = gap - closing + sunk
    depth = np.ptp(sunk) + mean * np.max(compliance_k[1:])
    residuals = [
        abs(pressure.mean() - mean) / mean,
        -pressure.min() / mean,
        -opening.min() / depth,
        np.abs(pressure * opening).mean() / (mean * depth),
    ]
    return float(np.max(residuals))


def press_periodic(compliance_k, gap, mean: float) -> PeriodicContact:
    """Solve the contact of one period under the pressure `mean` [Pa] with the gap (n,) [m] at equidistant points.

    compliance_k (n//2 + 1,) [m/Pa]: displacement per pressure of each wave, from k = 0, both bodies together; it is 0
    for k = 0, as for half planes, whose own is infinite. `closing` is the mean gap closed, mean(gap before) -
    mean(gap after). Cost: 1 to 4 sqrt(n) iterations, 10 sqrt(n) seen at worst, each two pairs of transforms.
    NotConverged when a residual exceeds 1e-9 after 50 sqrt(n) + 1000 iterations.
    """
    # subtracted, because a light load may close the gap by less than the round-off of the heights
    first = float(gap.min())
    gap = gap - first
    pressure, closing = _polonsky_keer(compliance_k, gap, mean)
    residual = find_residual(compliance_k, gap, pressure, closing, mean)
    if not residual <= LIMIT:  # written so that NaN also raises
        raise NotConverged(f"contact: the residual {residual:.2e} exceeds {LIMIT:.0e}")
    opening = gap - closing + irfft(compliance_k * rfft(pressure), gap.size)
    opening[pressure > 0] = 0.0
    return PeriodicContact(pressure, np.maximum(opening, 0.0), closing + first)


def _polonsky_keer(waves, gap, mean: float) -> tuple[np.ndarray, float]:
    """Return pressure (n,) [Pa] and closing [m] by the method of Polonsky and Keer.

    The first entry of `waves` must be 0.
    """
    n = gap.size
    pressure = np.full(n, mean)
    direction = np.zeros(n)
    sunk = None
    # `own` is the displacement of a point under its own pressure
    old = 0.0
    own = irfft(waves, n)[0]
    for count in range(1, int(50 * np.sqrt(n)) + 1001):
        carried = sunk is not None
        if not carried:
            sunk = irfft(waves * rfft(pressure), n)
        opening = gap + sunk
        touching = pressure > 0
        closing = opening[touching].mean()
        opening -= closing
        depth = np.ptp(sunk) + mean * waves[1]
        if max(np.abs(opening[touching]).max(), -opening.min()) <= TOLERANCE * depth:
            if not carried:
                return pressure, float(closing)
            # convergence is confirmed with displacements computed again from the pressure
            sunk = None
            old = 0.0
            continue
        size = opening[touching] @ opening[touching]
        direction = np.where(touching, opening + (size / old if old > 0 else 0.0) * direction, 0.0)
        answer = irfft(waves * rfft(direction), n)
        bend = (answer[touching] - answer[touching].mean()) @ direction[touching]
        if not bend > 0 and opening.min() >= 0:  # only round-off is left
            return pressure, float(closing)
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
    return pressure, float(closing)
