"""How stiff is the rough skin, 1e15 or 1e13 Pa/m, and does it decide at which tilt the rig's pieces open?

Both figures are right, of two different surfaces. Equally high ridges across the whole width, all that a plane model of
the report's 80 um waves knows, have 4.5e14 Pa/m at the rig's 0.717 MPa (9.9e14 with carbide of 600 GPa); an isotropic
surface has round peaks, 2.7e13 when equally high; and peaks of unequal height lower both. k_n in Pa/m:

  scatter              0        10 nm    50 nm    0.2 um   1 um     5 um
  ridges, uniform      4.48e14  2.9e14   1.1e14   4.9e13   2.1e13   0.88e13
  ridges, Gaussian     4.48e14  1.35e14  3.4e13   1.1e13   3.0e12   1.4e12 (one ridge of 160 touches)
  peaks, uniform       2.74e13  2.74e13  2.64e13  1.65e13  8.6e12   4.5e12
  peaks, Gaussian      2.74e13  2.69e13  1.79e13  7.2e12   2.0e12   5.6e11
  Greenwood-Williamson 2.68e13  2.64e13  1.77e13  7.2e12   2.0e12   4.9e11

One unknown per peak gives these; the ridges resolved by 2^18 points agree to 0.7 %, orders of the heights differ by 10
to 20 %, and peaks that do not feel each other (Greenwood-Williamson) are 2 % softer, 13 % where only 4 of 1024 touch.
1e13 Pa/m is the scatter of ridges by 4 to 5 um uniform or 0.2 um Gaussian, of peaks by 0.68 um uniform or 0.13 um
Gaussian; p/k_n, the u0 of an exponential law, is 0.50, 0.36, 0.29 of a Gaussian scatter of 0.2, 1, 5 um. The hottest
peak bears 5.2 GPa when all are equally high, 11 GPa (about the hardness of carbide) at 50 nm Gaussian, 46 GPa at 5 um:
so a bedded surface has 1.8e13 to 2.7e13, a fresh one less than 1e13 and peaks that yield, which this leaves out.

The bare pieces open at 9.28e-6 rad, and a skin adds 2 p/(k_n L), a rigid pad's opening, to 1 %: 9.36e-6 rad at 1e15
Pa/m, 9.47e-6 at 4.5e14, 1.34e-5 at 2.7e13, 2.06e-5 at 1e13, 1.2e-4 at 1e12, 2.4e-4 at 5e11. Above 1e14 the skin does
not matter, at 1e13 as much as the pieces, below 1e12 they do not. Scattered peaks never open; half of the patch rubs at
5.0e-5, 6.3e-5, 1.07e-4, 2.9e-4, 1.06e-3 rad for 10 nm .. 5 um Gaussian, at 2.9e-5 bare.

Run: python studies/misalignment/rough_skin.py [--full]      (3 of the scatters; --full: all six)
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import asperities
import contact_forms as exact
import tilted
from asperities import MEAN
from study_run import Option, run_study

from patchfem.contact import Holders, press_patch
from patchfem.core import Compliance

SCATTERS = (0.0, 10e-9, 50e-9, 0.2e-6, 1e-6, 5e-6)
SHAPES = ("uniform", "gaussian")
STIFFNESSES = (1e15, 4.5e14, 1e14, 2.7e13, 1e13, 1e12, 5e11)


def opening(stiffness: float | None) -> float:
    """Return the tilt [rad] at which the rig's pieces begin to open with a linear layer [Pa/m], or None without a layer."""
    pieces = tilted.pair(2).compliance
    x = pieces.interface.x
    if stiffness is not None:
        softened = pieces.normal + np.diag(1 / (stiffness * pieces.interface.weight))
        pieces = Compliance(pieces.interface, softened, pieces.tangential)
    holder = Holders(tilted.case(0.0).loading.load)
    # at both tilts the whole length is in contact
    states = [press_patch(pieces, by * x, holder) for by in (0.0, 1e-7)]
    even, turn = (state.force / pieces.interface.weight for state in states)
    return float(1e-7 * (even / np.maximum(even - turn, 1e-300)).min())


def row(
    scatter: float, shape: str, ridges: int = 160, side: int = 32, points: int = 0, seeds: int = 3
) -> dict:
    """Return k_n [Pa/m] for one scatter of heights.

    It is computed for ridges (median of `seeds` orders), for round peaks, and for resolved ridges
    if `points` > 0.
    """
    many = [
        asperities.one_each(asperities.depths(ridges, scatter, shape, k))[0] for k in range(seeds)
    ]
    peaks, force = asperities.one_each(asperities.depths(side**2, scatter, shape), True)
    modulus = exact.combined_modulus(*asperities.CARBIDE)
    hottest = (6 * force.max() * modulus**2 / (np.pi**3 * asperities.RADIUS**2)) ** (1 / 3)
    out = {
        "ridges": float(np.median(many)),
        "first": many[0],
        "peaks": peaks,
        "touching": float((force > 0).mean()),
        "hottest": float(hottest),
        "separate": asperities.separate(scatter, shape),
    }
    if points:
        out["explicit"] = asperities.explicit(asperities.depths(ridges, scatter, shape), points)
    return out


def main(scatters=SCATTERS, shapes=SHAPES, **how) -> dict:
    """Print and return {(shape, scatter): row}, with the opening tilts of linear layers of some stiffnesses."""
    out = {(shape, s): row(s, shape, **how) for shape in shapes for s in scatters}
    for (shape, s), found in out.items():
        cells = (f"{name} {value:.3g}" for name, value in found.items())
        print(f"{shape:9} {1e9 * s:6.0f} nm", *cells, sep="  ", flush=True)
    return out


def print_all(*, full: bool = False) -> None:
    """Print the rows of three scatters, or of all six, and the opening tilts of layers."""
    main(SCATTERS if full else tuple(SCATTERS[k] for k in (0, 3, 5)), points=2**18)
    print(f"bare pieces open at {opening(None):.3e} rad")
    for k in STIFFNESSES:
        rigid = exact.wedge_opening_tilt(MEAN * 12.7e-3**2, 12.7e-3, 12.7e-3, k)
        print(f"k_n {k:.1e} Pa/m: {opening(k):.3e} rad; rigid pieces {rigid:.3e} rad")


if __name__ == "__main__":
    run_study(print_all, full=Option(False, "all six scatters"))
