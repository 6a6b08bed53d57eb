"""How much of the patch touches when the pieces are misaligned, and what does the fixture decide?

The fixture decides. With a rigid fixture the rig's pieces lose full contact at about 1e-5 rad and touch on half of the
patch at 3.0e-5 rad, that is 0.38 um over its 12.7 mm, on a fifth at 1.1e-4 rad. A holder of 1e4 N m/rad lets half of it
touch up to 7.6e-5 rad, one of 1e3 up to 4.9e-4, one of 1e2 up to 4.6e-3 rad (59 um). So "rubbing on a portion of the
area" (the report's conclusion 5) follows from a machining error of half a micrometre in a fixture stiffer than about
1e5 N m/rad, and tells nothing about the error as long as the stiffness of the fixture is not known. The smooth elastic
pieces alone are meant here: a rough skin, which would spread the contact, is not in these numbers.

Run: python studies/misalignment/fixtures.py
"""

from pathlib import Path

import numpy as np

from patchfem import scene
from patchfem.simulate_bodies import grid_of
from patchfem.simulate_measures import values
from patchfem.simulate_patch import solve

SCENE = Path(__file__).parents[1] / "rig" / "rig.toml"
TILTS = 10.0 ** np.arange(-6, -1.5, 0.5)
SPRINGS = (None, 1e6, 1e5, 1e4, 1e3, 1e2)  # N m/rad; None: a rigid fixture
NAMES = ("contact_fraction", "pressure_peak", "pressure_centre", "normal_stiffness", "tangential_stiffness", "rotation")


def case(angle: float, spring: float | None) -> dict:
    """Static measures of the rig's pieces at one tilt [rad] of the holder and one holder stiffness [N m/rad]."""
    sets = [f"contact.tilt.angle={angle!r} rad"]
    if spring is not None:
        sets.append(f"contact.holder.rotational_stiffness={spring!r} N m/rad")
    found = scene.load(SCENE, sets)
    return {name: value for name, value in values(solve(found, grid_of(found))).items() if name in NAMES}


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


def main(tilts=TILTS, springs=SPRINGS) -> dict:
    """{(tilt, spring): measures}, printed as a table of contact fractions with peak, centre and stiffness."""
    out = {}
    for spring in springs:
        print("rigid fixture" if spring is None else f"holder {spring:.0e} N m/rad")
        for angle in tilts:
            found = out[angle, spring] = case(float(angle), spring)
            print(f"  tilt {angle:8.1e}  contact {found['contact_fraction']:.4f}  "
                  f"peak {found['pressure_peak'] / 1e6:8.3f} MPa  centre {found['pressure_centre'] * 1e3:7.3f} mm  "
                  f"K_n {found['normal_stiffness']:.3e}  K_t {found['tangential_stiffness']:.3e} N/m  "
                  f"rotation {found['rotation']:.2e}")
    return out


if __name__ == "__main__":
    main()
    for spring in SPRINGS:
        print(spring, f"half contact at {tilt_for(0.5, spring):.2e} rad, a fifth at {tilt_for(0.2, spring):.2e} rad")
