"""Where does a roll about the sliding axis move the pressure, and how hard does friction then yaw the block?

Bare, a roll of 1e-5 rad moves the pressure 2.14 mm sideways and sliding friction (0.3) yaws with 74 N mm; 1e-4 rad 5.0
mm and 173 N mm; from 1e-3 rad on one corner strip carries: at most mu N b/2 = 220 N mm. With the linear skin 35 and
152 N mm at 1e-5 and 1e-4 rad, with the peaks 28 and 152, with the exponential skin 1.8 and 18 (133 at 1e-3). The 3.8 mm
to which the yaw mode of rig.toml was fitted are a roll of 2.7e-5 rad bare, 5.9e-5 linear, 6.6e-5 on peaks, 9.8e-4
exponential: 0.35 to 12.5 um over the width.

Errors: the mesh 1 % (K_t 3 %); 8 and 16 strips differ by 2 % in the moment until a quarter of the patch is left, then
by half a strip (0.8 and 0.4 mm of the lever: 193 and 207 N mm stand for 220). Strips do not feel each other, as springs
do not: they follow `wedge_on_linear_foundation` with the pieces' own K_n/A. The pieces are square, so `fixtures.py`
holds the bare roll with that shear kept, in plane strain: centre 2.07 mm at 1e-5 rad (strips 3 % more), 5.32 mm at 1e-4
(6 % less), 6.24 mm at 1e-3.

Run: python studies/misalignment/roll.py
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import tilted
from scipy.optimize import brentq

from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.values import compute_static_values

FRICTION = 0.3  # friction coefficient of rig.toml
COUNTS = (8, 16)
SLIDE = 0.095  # `slide` of the yaw mode as fitted to Table 1
GYRATION = 40e-3  # [m] friction acts SLIDE * GYRATION off the axis


def rolled_pieces(roll: float, count: int, skin: str):
    return tilted.case(0.0, skin, f"strips.count={count}", f"strips.roll={float(roll)!r} rad")


def case(roll: float, count: int, skin: str = "bare") -> dict:
    """Return {name: Measure} of pieces in strips under a roll [rad], with `yaw` [N m], the moment of sliding friction."""
    three = [solve_patch_contact(rolled_pieces(roll, count, skin), tilted.pair(k)) for k in (1, 0)]
    return tilted.estimate_static_measures(*three) | {
        "yaw": FRICTION * abs(three[0].strips.roll_moment)
    }


def roll_for(centre: float, skin: str, count: int = 16) -> float:
    """Return the roll [rad] that moves the pressure sideways by `centre` [m]."""

    def short(log_roll: float) -> float:
        found = compute_static_values(
            solve_patch_contact(rolled_pieces(10**log_roll, count, skin), tilted.pair(0))
        )
        return abs(found["pressure_centre_lateral"]) - centre

    return 10 ** brentq(short, -7, -1.5, xtol=1e-6)


def main(rolls=tilted.TILTS, counts=COUNTS, skins=tuple(tilted.SKINS)) -> dict:
    """Print and return {(skin, count, roll): measures}."""
    out = {}
    for skin in skins:
        for roll in rolls:
            for count in counts:
                found = out[skin, count, roll] = case(roll, count, skin)
                names = (
                    "contact_fraction",
                    "loaded_fraction",
                    "pressure_peak",
                    "normal_stiffness",
                    "tangential_stiffness",
                )
                print(
                    f"{skin:12} roll {roll:7.1e} strips {count:3}  centre "
                    f"{1e3 * found['pressure_centre_lateral'].value:7.4f} mm  roll moment "
                    f"{1e3 * found['roll_moment'].value:8.3f} N mm  yaw {1e3 * found['yaw']:8.4f} N mm  "
                    + "  ".join(
                        f"{name} {found[name].value:.4g} ±{found[name].error:.1g}" for name in names
                    ),
                    flush=True,
                )
    return out


if __name__ == "__main__":
    main()
    for skin in tilted.SKINS:
        print(
            f"{skin}: pressure {1e3 * SLIDE * GYRATION:.1f} mm off the axis at a roll of "
            f"{roll_for(SLIDE * GYRATION, skin):.3g} rad (8 strips {roll_for(SLIDE * GYRATION, skin, 8):.3g})"
        )
