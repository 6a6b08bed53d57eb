"""Where does a roll about the sliding axis move the pressure, and how hard does friction then yaw the block?

Bare, a roll of 1e-5 rad moves the pressure 1.92 mm sideways and sliding friction (0.3) yaws with 66 N mm; 1e-4 rad 5.28 mm
and 183 N mm; 1e-3 rad 6.23 mm and 216 N mm, nearly the mu N b/2 = 220 N mm of one side. With the linear skin 33, 154 and
203 N mm. The 3.8 mm to which the yaw mode of rig.toml was fitted are a roll of 2.8e-5 rad bare and 5.9e-5 linear: 0.35 and
0.75 um over the width.

The pressure is that of blocks with four free sides ([contact.area]); its errors are below 1 %.

Run: python studies/misalignment/roll.py
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from study_run import run_study

import patchfem as pf

FRICTION = 0.3  # friction coefficient of rig.toml
LOAD = 26 * 4.4482216152605  # [N] load of rig.toml
ROLLS = (1e-5, 1e-4, 1e-3)  # [rad]
SLIDE = 0.095  # `slide` of the yaw mode as fitted to Table 1
GYRATION = 40e-3  # [m] friction acts SLIDE * GYRATION off the axis
SKINS = {
    "bare": {},
    "linear": {"asperities": {"law": "linear", "normal_stiffness": "1e13 Pa/m"}},
}
PIECES = {
    "length": "12.7 mm",
    "width": "12.7 mm",
    "height": "6.35 mm",
    "load": "26 lbf",
    "substrate": "Ti-8Al-1Mo-1V",
    "coating": {"material": "WC-Co", "thickness": "6 mil"},
}


def find_centre(roll: float, skin: str = "bare", cells: int = 128) -> pf.Measure:
    """Return the lateral position [m] of the resultant pressure under a roll [rad], with its error."""
    tilt = {"angle": "0 rad", "roll": f"{float(roll)!r} rad"}
    contact = PIECES | {"area": {"cells": cells}, "tilt": tilt} | SKINS[skin]
    return pf.run({"contact": contact}).measures["pressure_centre_y"]


def find_roll(centre: float, skin: str, cells: int = 64) -> float:
    """Return the roll [rad] that moves the pressure sideways by `centre` [m]."""
    from scipy.optimize import brentq

    def find_excess(log_roll: float) -> float:
        return abs(find_centre(10**log_roll, skin, cells).value) - centre

    return 10 ** brentq(find_excess, -6, -3, xtol=1e-3)


def main() -> dict:
    """Print and return {(skin, roll): centre as a Measure}."""
    centres = {}
    for skin in SKINS:
        for roll in ROLLS:
            centre = centres[skin, roll] = find_centre(roll, skin)
            moment = FRICTION * LOAD * abs(centre.value)
            print(f"{skin:6} roll {roll:.0e}: centre {centre}, yaw moment {1e3 * moment:.1f} N mm")
        fitted = find_roll(SLIDE * GYRATION, skin)
        print(f"{skin}: pressure {1e3 * SLIDE * GYRATION:.1f} mm off the axis at {fitted:.3g} rad")
    return centres


if __name__ == "__main__":
    run_study(main)
