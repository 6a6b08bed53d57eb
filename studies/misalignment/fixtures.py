"""How much of the patch touches when the pieces are misaligned, and what does the fixture decide?

The fixture decides. With a rigid one the rig's smooth pieces lose full contact at 9.3e-6 rad and touch on half of the
patch at 2.9e-5 rad, that is 0.37 um over its 12.7 mm, on a fifth at 1.1e-4 rad:

  tilt      in contact        mean/peak  peak MPa    centre mm  K_n N/um    K_t N/um
  1e-6      1                 0.700      1.025       -0.207     1850 ± 3    404 ± 2
  1e-5      0.936 ± 0.006     0.373      1.923       -2.072     1825 ± 5    404 ± 2
  1e-4      0.219 ± 0.005     0.0862     8.32        -5.324     534 ± 2     229 ± 1
  1e-3      0.0241 ± 0.0006   0.0118     60.9        -6.241     170 ± 1     120 ± 1
  1e-2      0.00168 ± 0.0001  0.0009     790 ± 10    -6.342     96 ± 1      84 ± 1

A holder's spring gives way until its moment is that of the pressure, so every row is met later: half contact at 3.4e-5
rad with 1e5 N m/rad, 7.5e-5 with 1e4, 4.9e-4 with 1e3 and 4.6e-3 rad (59 um) with 1e2. A piece free to rotate keeps
full contact under a load line up to 0.15 lengths from its middle and touches on 0.445 ± 0.006 of the patch at a third,
where a rigid pad on springs has L/6 and 0.5 (the kern). No skin is in these numbers: see `skins.py`.

Run: python studies/misalignment/fixtures.py
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import tilted

from patchfem.core import Measure
from patchfem.runs.patch.press import pressed
from patchfem.runs.patch.values import values

SPRINGS = (None, 1e6, 1e5, 1e4, 1e3, 1e2)  # N m/rad; None: a rigid fixture
OFFSETS = (0.05, 0.1, 1 / 6, 0.2, 0.25, 0.3, 1 / 3, 0.4, 0.45, 0.49)  # of the load line of a free piece, in lengths
COLUMNS = {"contact_fraction": ("contact", 1), "loaded_fraction": ("loaded", 1), "pressure_peak": ("peak MPa", 1e-6),
           "pressure_centre": ("centre mm", 1e3), "rotation": ("rotation mrad", 1e3),
           "normal_stiffness": ("K_n N/um", 1e-6), "tangential_stiffness": ("K_t N/um", 1e-6)}


def held(angle: float, spring: float | None, skin: str = "bare"):
    """Pieces in a holder at the neutral angle [rad] with its spring [N m/rad], None: rigid."""
    more = () if spring is None else (f"holder.rotational_stiffness={spring!r} N m/rad",)
    return tilted.case(float(angle), skin, *more)


def free(offset: float, skin: str = "bare"):
    """A piece free to rotate, the load line `offset` lengths from its middle towards the fine edge."""
    return tilted.case(None, skin, f"load_line.offset={-12.7 * offset!r} mm")


def case(angle: float, spring: float | None) -> dict:
    """Values of the measures at one neutral angle [rad] of the holder and one stiffness [N m/rad] of it."""
    return values(pressed(held(angle, spring), tilted.pair(1)))


def tilt_for(fraction: float, spring: float | None, steps: int = 30) -> float:
    """Tilt [rad] at which the contact fraction has fallen to `fraction`, by bisection of its logarithm."""
    low, high = 1e-7, 1e-1
    for _ in range(steps):
        middle = float(np.sqrt(low * high))
        if case(middle, spring)["contact_fraction"] > fraction:
            low = middle
        else:
            high = middle
    return float(np.sqrt(low * high))


def line(found: dict) -> str:
    """The measures of a case in a row, value and error; no error where it is below a thousandth."""
    out = []
    for name, (head, scale) in COLUMNS.items():
        one = found[name]
        error = f" ±{one.error * scale:.1g}" if one.error > 1e-3 * abs(one.value) else ""
        out.append(f"{head} {one.value * scale:.4g}{error}")
    return "  ".join(out)


def table(title: str, named: str, cases: dict, measured: Callable = tilted.measured) -> dict:
    """{key: measures} of {key: pieces}, printed as they come."""
    print(title)
    out: dict[float, dict[str, Measure]] = {}
    for key, found in cases.items():
        out[key] = measured(found)
        print(f"  {named} {key:8.3g}  {line(out[key])}", flush=True)
    return out


def main(tilts=tilted.TILTS, springs=SPRINGS, offsets=OFFSETS) -> dict:
    """{spring or "free": {tilt [rad] or offset [lengths]: measures}}, printed."""
    out = {spring: table("rigid fixture" if spring is None else f"holder {spring:.0e} N m/rad", "tilt rad",
                         {tilt: held(tilt, spring) for tilt in tilts}) for spring in springs}
    out["free"] = table("free to rotate", "offset/length", {offset: free(offset) for offset in offsets})
    return out


if __name__ == "__main__":
    main()
    for spring in SPRINGS:
        print(spring, f"half contact at {tilt_for(0.5, spring):.2e} rad, a fifth at {tilt_for(0.2, spring):.2e} rad")
