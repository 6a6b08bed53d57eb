"""How does friction depend on speed in steady sliding, as benches compute it? `stribeck.svg`, and its numbers.

The stretch reading gives the curve that 2.11 and 2.18-2.21 promise, a Lorentzian in the speed, mu_k + (mu_s - mu_k) /
(1 + (v/v_c)^2) with v_c = sqrt(a_s l_k), to 1e-12 at every speed from 0.01 to 100 v_c, whatever the slip growth. The
law as printed grows every bond from zero and so carries G(ell/eps; p) of it, 1/ell = a_s/v^2 + 1/l_k: fast sliding with
l_k = 0.1 eps_0 changes 2.18 by +2.1 % (p = 1) and -2.7 % (p = 0); with l_k = eps_0 by -15 % and -63 %, so that there
mu_k is not mu_s eps_k/eps_0 as 2.21 has it. The benches follow G to 2e-6.

Run: python studies/bench/stribeck.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from friction_forms import growth_factor, steady_bond_length
from study_run import run_study

from patchfem.model import build
from patchfem.runs.bench import bench as law_bench
from patchfem.scene import scene

FOLDER = Path(__file__).parent
SHARES = 10.0 ** np.linspace(-2, 2, 9)  # velocity / characteristic velocity
LENGTH = 2e-6  # [m] length of a bond after unlimited ageing
RATIO = 0.7  # kinetic friction / static friction
STATIC = 0.6  # coefficient of static friction
REST_GROWTH = 10.0  # [m/s^2] growth of the bond length at rest
SCENE = """
[normal]
load = "100 N"
[friction]
law = "nonlocal"
static = 0.6
kinetic = 0.42
bond_length = "2 um"
rest_growth = "10 m/s^2"
initial_bonds = 0.0
[slide]
kind = "constant"
[accuracy]
tail = 1e-12
"""


def bench(speed: float, slip: float, reading: str, order: float, lengths: int) -> float:
    """Return friction over load after a slide of several bond lengths at a constant speed [m/s], ten steps for each."""
    sets = [
        f"slide.speed={speed!r} m/s",
        f"slide.distance={lengths * LENGTH!r} m",
        f"friction.slip_growth={slip!r} m",
        f"friction.reading={reading}",
        f"friction.order={order}",
        "friction.rest_speed=1e-9 m/s",
    ]
    return law_bench.run_bench(build(scene.loads(SCENE, sets=sets)), None, 10 * lengths).values[
        "friction_ratio_end"
    ]


def steady_friction(speed: float, slip: float) -> float:
    """Return the steady friction over load by equation 2.18, with the bond length of equation 2.11."""
    return STATIC * steady_bond_length(speed, LENGTH, RATIO, REST_GROWTH, slip) / LENGTH


def _steady_friction_of_grown_bonds(speed: float, slip: float, order: float) -> float:
    """Return the steady friction over load if every bond grows from zero."""
    ell = 1 / (REST_GROWTH / speed**2 + 1 / slip)
    return steady_friction(speed, slip) * growth_factor(
        ell / steady_bond_length(speed, LENGTH, RATIO, REST_GROWTH, slip), order
    )


def main(shares=SHARES, slips=(0.1, 1.0), path: Path | None = FOLDER / "stribeck.svg") -> list:
    """Return a dict for each slip growth (in eps_0) and speed (in v_c).

    It has the closed form, the stretch reading, and (computed value, G) for each printed order.
    """
    rows = []
    for part in slips:
        slip = part * LENGTH
        for share in shares:
            speed = float(share * np.sqrt(REST_GROWTH * slip))
            row = {
                "slip": part,
                "share": float(share),
                "promised": steady_friction(speed, slip),
                "stretch": bench(speed, slip, "stretch", 1.0, 32),
            }
            row |= {
                order: (
                    bench(speed, slip, "report", order, 20),
                    _steady_friction_of_grown_bonds(speed, slip, order),
                )
                for order in (0, 1)
            }
            rows.append(row)
            print(
                f"l_k = {part:g} eps_0, v = {share:7.3g} v_c: promised {row['promised']:.6f}, stretch "
                f"{row['stretch']:.6f}, printed p = 0 {row[0][0]:.6f} (G {row[0][1]:.6f}), p = 1 {row[1][0]:.6f} "
                f"(G {row[1][1]:.6f})"
            )
    if path is not None:
        _draw(path, rows, slips)
    return rows


def _draw(path: Path, rows: list, slips) -> None:
    """Plot friction against speed, one panel for each slip growth; lines are closed forms, markers are computed."""
    with drawing(path, (9.6, 3.4), 1, len(slips), sharey=True, squeeze=False) as (_, axes):
        for axis, part in zip(axes[0], slips):
            slip = part * LENGTH
            mine = [row for row in rows if row["slip"] == part]
            fine = 10.0 ** np.linspace(-2, 2, 81)
            speeds = fine * np.sqrt(REST_GROWTH * slip)
            at = [row["share"] for row in mine]
            axis.semilogx(
                fine,
                [steady_friction(v, slip) for v in speeds],
                color=BLUE,
                label="2.18, Lorentzian",
            )
            axis.semilogx(
                at, [row["stretch"] for row in mine], "o", color=BLUE, ms=5, label="stretch reading"
            )
            for order, colour in ((1, ORANGE), (0, GREY)):
                axis.semilogx(
                    fine,
                    [_steady_friction_of_grown_bonds(v, slip, order) for v in speeds],
                    color=colour,
                    label=f"2.18 G, p = {order}",
                )
                axis.semilogx(
                    at, [row[order][0] for row in mine], "s", color=colour, ms=4, label="as printed"
                )
            axis.set(
                xlabel="speed over √(rest growth × slip growth)",
                title=f"slip growth {part:g} ε₀",
                ylim=(0, 0.65),
            )
        axis.legend(fontsize=8.5)
        axes[0, 0].set_ylabel("friction over load")


if __name__ == "__main__":
    run_study(main)
