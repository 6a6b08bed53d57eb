"""How much of the patch touches when the pieces are misaligned, and what does the fixture decide?

The fixture decides. With a rigid one the rig's smooth pieces lose full contact at 9.3e-6 rad and touch on half of the
patch at 2.9e-5 rad, that is 0.37 um over its 12.7 mm, on a fifth at 1.1e-4 rad:

  tilt      in contact  mean/peak       peak MPa       centre mm        K_n N/um    K_t N/um
  1e-6      1           0.699 ± 0.01    1.025 ± 0.01   -0.2075±0.0004   1850 ± 2    404 ± 1
  1e-5      0.935±0.001 0.3728±0.0006   1.923 ±0.003   -2.0725±0.004    1826 ± 2    404 ± 1
  1e-4      0.2193      0.08615±0.0001  8.324 ± 0.01   -5.324           535.2       229.1±0.3
  1e-3      0.02391     0.01178±0.00001 60.88 ± 0.07   -6.241           170.0       119.75±0.13
  1e-2      0.001675    0.000904±0.000002 793.3 ± 1.4  -6.342           96.23       84.09±0.09

(an error stands where it is above a thousandth). A holder's spring gives way until its moment is that of the pressure,
so every row is met later: half contact at 3.4e-5 rad with 1e5 N m/rad, 7.5e-5 with 1e4, 4.9e-4 with 1e3 and 4.6e-3 rad
(59 um) with 1e2. A piece free to rotate keeps full contact under a load line up to 0.15 lengths from its middle and
touches on 0.445 of the patch at a third, where a rigid pad on springs has L/6 and 0.5 (the kern). No skin is in these
numbers: see `skins.py`.

Run: python studies/misalignment/fixtures.py
"""

import sys
from pathlib import Path

from scipy.optimize import bisect

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import tilted
from study_run import run_study

from patchfem.core import Measure
from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.values import compute_static_values

# [N m/rad] rotational stiffnesses of the fixture; None is a rigid fixture
SPRINGS = (None, 1e6, 1e5, 1e4, 1e3, 1e2)
# offsets of the load line of a free piece / length of the piece
OFFSETS = (
    0.05,
    0.1,
    1 / 6,
    0.2,
    0.25,
    0.3,
    1 / 3,
    0.4,
    0.45,
    0.49,
)
COLUMNS = {
    "contact_fraction": ("contact", 1),
    "loaded_fraction": ("loaded", 1),
    "pressure_peak": ("peak MPa", 1e-6),
    "pressure_centre": ("centre mm", 1e3),
    "rotation": ("rotation mrad", 1e3),
    "normal_stiffness": ("K_n N/um", 1e-6),
    "tangential_stiffness": ("K_t N/um", 1e-6),
}


def held_pieces(angle: float, spring: float | None, skin: str = "bare"):
    """Return pieces in a holder with a neutral angle [rad] and a rotational spring [N m/rad], or None for a rigid holder."""
    more = () if spring is None else (f"holder.rotational_stiffness={spring!r} N m/rad",)
    return tilted.case(float(angle), skin, *more)


def free(offset: float, skin: str = "bare"):
    """Return pieces of which one rotates freely; the load line is `offset` patch lengths from the middle.

    A positive offset is towards the fine edge.
    """
    return tilted.case(None, skin, f"load_line.offset={-12.7 * offset!r} mm")


def case(angle: float, spring: float | None) -> dict:
    """Return the measures for a neutral angle [rad] and a stiffness [N m/rad] of the holder."""
    return compute_static_values(solve_patch_contact(held_pieces(angle, spring), tilted.pair(1)))


def tilt_for(fraction: float, spring: float | None) -> float:
    """Return the tilt [rad] at which the contact fraction has fallen to `fraction`."""

    def excess(log_tilt: float) -> float:
        return case(10**log_tilt, spring)["contact_fraction"] - fraction

    return 10 ** bisect(excess, -7, -1, xtol=1e-8)


def line(found: dict) -> str:
    """Format the measures of a case as a row of values and errors; errors below a thousandth of the value are left out."""
    out = []
    for name, (head, scale) in COLUMNS.items():
        one = found[name]
        error = f" ±{one.error * scale:.1g}" if one.error > 1e-3 * abs(one.value) else ""
        out.append(f"{head} {one.value * scale:.4g}{error}")
    return "  ".join(out)


def table(title: str, named: str, cases: dict) -> dict:
    """Print the measures of several pieces while they are computed, and return {key: measures}."""
    print(title)
    out: dict[float, dict[str, Measure]] = {}
    for key, found in cases.items():
        out[key] = tilted.compute_measures(found)
        print(f"  {named} {key:8.3g}  {line(out[key])}", flush=True)
    return out


def main(tilts=tilted.TILTS, springs=SPRINGS, offsets=OFFSETS) -> dict:
    """Print and return {spring or "free": {tilt [rad] or offset [patch lengths]: measures}}."""
    out = {
        spring: table(
            "rigid fixture" if spring is None else f"holder {spring:.0e} N m/rad",
            "tilt rad",
            {tilt: held_pieces(tilt, spring) for tilt in tilts},
        )
        for spring in springs
    }
    out["free"] = table(
        "free to rotate", "offset/length", {offset: free(offset) for offset in offsets}
    )
    return out


def print_all() -> None:
    """Print the measures of every fixture, and the tilts at which half and a fifth are in contact."""
    main()
    for spring in SPRINGS:
        print(
            spring,
            f"half contact at {tilt_for(0.5, spring):.2e} rad, a fifth at {tilt_for(0.2, spring):.2e} rad",
        )


if __name__ == "__main__":
    run_study(print_all)
