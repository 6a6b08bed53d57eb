"""Which misalignment does "rubbing on only a portion of the area" (the report's conclusion 5) imply?

The report gives no portion, in words or in the captions of its photographs, so here is the misalignment for each. A
portion f rubs (bears a tenth of the mean pressure or more) at theta(f) + M(f)/K, K the rotational stiffness of the
holder, exactly; the two numbers of each skin, to 1 % (the last row 2 %):

  f      bare                 linear 1e13 Pa/m     peaks 0.2 um         exponential 2.5 um
  0.9    1.0e-5 rad 0.25 N m  2.3e-5 rad 0.26 N m  4.2e-5 rad 0.34 N m  8.3e-4 rad 0.40 N m
  0.5    2.9e-5     0.46      7.4e-5     0.48      1.07e-4    0.53      1.8e-3     0.57
  0.2    1.1e-4     0.63      4.0e-4     0.63      3.9e-4     0.66      5.7e-3     0.68
  0.05   5.1e-4     0.71      5.1e-3     0.71      2.3e-3     0.72      3.0e-2     0.72

So half of the patch means 0.37 um over its 12.7 mm in a rigid fixture without a skin and 23 um with the softest; a
holder of 1e3 N m/rad makes it 4.9e-4 to 2.4e-3 rad, one of 1e2 4.6e-3 to 7.5e-3 rad whatever the skin. Holders with
which a given misalignment leaves between 5 and 90 %, in N m/rad:

  1e-4 rad (1.3 um)             2.8e3 and more   3.4e3 and more   5.9e3 and more   none: it all rubs
  4e-4 rad (5 um)               640 and more     700 and more     960 and more     none: it all rubs
  2e-3 rad (25 um, 0.001 in)    125 to 480       133 and more     175 and more     345 and more
  1e-2 rad (127 um)             25 to 75         26 to 144        34 to 93         44 and more

The report's rocking mode at 73 Hz, were it the block on this spring with a radius of gyration of 40 mm (assumed), is
298 N m/rad: half of the patch then means 1.6 to 1.9 mrad, 20 to 24 um, on all but the exponential skin (3.7 mrad). An
error of a machinist's 0.001 in and that mount explain conclusion 5; a rigid mount explains it with a hundredth.

Run: python studies/misalignment/conclusion_5.py
"""

import sys
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import tilted
from scipy.optimize import brentq
from study_run import run_study

from patchfem.runs.patch.press import solve_patch_contact

PORTIONS = (0.9, 0.5, 0.2, 0.05)
# [N m/rad] rotational stiffnesses of the fixture; None is a rigid fixture
SPRINGS = (None, 1e5, 1e4, 1e3, 300.0, 1e2)
# misalignments [rad]; over 12.7 mm they are 0.13, 1.3, 5, 25 (0.001 in) and 127 um
TOLERANCES = (
    1e-5,
    1e-4,
    4e-4,
    2e-3,
    1e-2,
)
# rocking stiffness [N m/rad] from the report's 73 Hz, the mass of rig.toml and its assumed radius of gyration
ROCKING = 0.884 * (40e-3 * 2 * np.pi * 73) ** 2


@cache
def rigid(portion: float, skin: str, halvings: int = 2) -> tuple:
    """Find the tilt [rad] and moment [N m] at which a rigid fixture leaves a portion of the patch rubbed.

    Parameters
    ----------
    portion : float
    skin : str
    halvings : int
        Refinements of the mesh.
    """

    def press(log_tilt: float):
        return solve_patch_contact(tilted.case(10**log_tilt, skin), tilted.pair(halvings))

    tilt = brentq(
        lambda log_tilt: tilted.rubbed_portion(press(log_tilt)) - portion, -6, -1.3, xtol=1e-5
    )
    return 10**tilt, -press(tilt).pressure.moment


def neutral(portion: float, skin: str, spring: float | None, halvings: int = 2) -> float:
    """Return the misalignment [rad] of the holder for which `portion` is rubbed.

    It is the remaining tilt plus the rotation of the spring.
    """
    tilt, moment = rigid(portion, skin, halvings)
    return tilt + (moment / spring if spring is not None else 0.0)


def springs_for(tolerance: float, skin: str) -> tuple[float, float] | None:
    """Find the smallest and largest stiffness [N m/rad] of a holder that leaves between 5 and 90 % rubbed.

    Parameters
    ----------
    tolerance : float
        Misalignment [rad].
    skin : str

    Returns
    -------
    tuple or None
        The largest stiffness may be infinite; None if no holder does.
    """
    (first, gives), (last, holds) = rigid(0.9, skin), rigid(0.05, skin)
    if tolerance <= first:
        return None
    return gives / (tolerance - first), holds / (tolerance - last) if tolerance > last else np.inf


def main(
    skins=tuple(tilted.SKINS), portions=PORTIONS, springs=SPRINGS, tolerances=TOLERANCES
) -> dict:
    """Print and return {(skin, portion, spring): misalignment [rad]} and {(skin, tolerance): `springs_for`}."""
    out = {}
    for skin in skins:
        for portion in portions:
            for spring in springs:
                out[skin, portion, spring] = neutral(portion, skin, spring)
            row = "  ".join(f"{out[skin, portion, s]:.3g}" for s in springs)
            print(
                f"{skin:12} {100 * portion:3.0f} % rubbed at {row} rad  (rigid, then {springs[1:]} N m/rad)"
            )
        for tolerance in tolerances:
            found = out[skin, tolerance] = springs_for(tolerance, skin)
            print(
                f"{skin:12} {tolerance:.0e} rad, {12.7e3 * tolerance:5.2f} um: "
                + ("none" if found is None else f"{found[0]:.3g} to {found[1]:.3g} N m/rad"),
                flush=True,
            )
    return out


def print_all() -> None:
    """Print the misalignments of every portion, and those at the rocking mode."""
    main()
    print(
        f"rocking at 73 Hz: {ROCKING:.0f} N m/rad: half at",
        {skin: round(1e3 * neutral(0.5, skin, ROCKING), 2) for skin in tilted.SKINS},
        "mrad",
    )


if __name__ == "__main__":
    run_study(print_all)
