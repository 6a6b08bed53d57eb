"""Does a rough skin between the pieces change what misalignment does?

It decides as much as the fixture. Portion that bears a tenth of the mean pressure or more, then the peak in MPa and the
stiffnesses K_n, K_t in N/um, with a rigid fixture; every figure to 1 % or better but K_n of the linear skin (4 %):

  tilt   bare                      linear, 1e13 Pa/m         peaks, 0.2 um scatter     exponential, u0 = 2.5 um
  1e-5   0.917   1.92 1826 404     1       1.04  861 303     1       1.00  705 276     1       0.73 45.1 33.8
  1e-4   0.220   8.32  535 229     0.428   3.27  391 193     0.523   3.97  426 199     1       0.91 45.1 33.8
  1e-3   0.024   60.9  170 120     0.120   12.0  120  80     0.096   25.0  160 105     0.786   3.53 43.6 32.5
  1e-2   0.0017   793   96  84     0.035   41.1   43  33     0.016    134   80  64     0.126   34.5 37.2 28.7

The soft skin hardly loses stiffness to a tilt, the bare pieces nineteen parts of twenty of K_n; only the place of the
pressure is the same in the end. Against rigid pads on the same skins (`contact_forms.wedge_on_asperities`) the pieces
themselves add 4 % to the mean over peak pressure of the exponential skin at 1e-3 rad, and 30 % to the part in
contact on the linear one at 1e-4 rad, whose stiffness is that of the pieces. Under a load line at a third of the length
the four bear 0.445, 0.479, 0.588 and 0.686 of the patch, a rigid pad on springs 0.5.

Run: python studies/misalignment/skins.py
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import fixtures
import tilted
from study_run import run_study

SPRING = 1e3  # [N m/rad] rotational stiffness of the fixture
OFFSETS = (1 / 6, 0.25, 1 / 3, 0.4, 0.45)


def main(tilts=tilted.TILTS, skins=tuple(tilted.SKINS), offsets=OFFSETS) -> dict:
    """Print and return {(skin, "rigid", "held" or "free"): {tilt [rad] or offset [patch lengths]: measures}}."""
    out = {}
    for skin in skins:
        out[skin, "rigid"] = fixtures.table(
            f"{skin}, rigid fixture",
            "tilt rad",
            {tilt: fixtures.held_pieces(tilt, None, skin) for tilt in tilts},
        )
        out[skin, "held"] = fixtures.table(
            f"{skin}, holder {SPRING:.0e} N m/rad",
            "tilt rad",
            {tilt: fixtures.held_pieces(tilt, SPRING, skin) for tilt in tilts},
        )
        out[skin, "free"] = fixtures.table(
            f"{skin}, free to rotate",
            "offset/length",
            {offset: fixtures.free(offset, skin) for offset in offsets},
        )
        print(
            "  rubbed",
            *(f"{tilt:.2g}: {found['rubbed']:.3f}" for tilt, found in out[skin, "rigid"].items()),
        )
    return out


if __name__ == "__main__":
    run_study(main)
