"""How does a contact age at rest, and what does it show when it breaks away? `ageing.svg`, and its numbers.

In the stretch reading the force at rest never moves; only the bond length grows, eps_d = eps_0 - (eps_0 - eps_k) times
exp(-a_s t/v_h) (2.10 with the floor v_h under the speed), and the peak after the rest with it. So ageing is exponential
with the one time v_h/a_s, here 0.5 s: half of it by 0.35 s, nine tenths by 1.15 s, none after some seconds; a contact
that ages with log t over decades does not follow 2.10. The peak stays below mu_s eps_d/eps_0 because the bonds shrink
again on the way: of the rise that a full rest promises 28 % shows with l_k = 0.5 eps_0, 68 % with 5 eps_0, 92 % with
50 eps_0. As printed, the force of the resting contact itself rises with no motion, from 0.517 to 1.000 of mu_s N in
10 s (l_k = 0.1 eps_0, p = 1).

Run: python studies/bench/ageing.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from friction_forms import steady_bond_length
from study_run import run_study

from patchfem.model import build
from patchfem.runs.bench import bench as law_bench
from patchfem.scene import scene

FOLDER = Path(__file__).parent
HOLDS = tuple(10.0 ** np.linspace(-2, 1, 10))
LENGTH = 2e-6  # [m] length of a bond after unlimited ageing
RATIO = 0.5  # kinetic friction / static friction
STATIC = 0.3  # coefficient of static friction
REST_GROWTH = 2e-6  # [m/s^2] growth of the bond length at rest
FLOOR = 1e-6  # [m/s] smallest speed in the growth at rest
SPEED = 1e-3  # [m/s] sliding velocity before and after the rest
SCENE = """
[normal]
load = "100 N"
[friction]
law = "nonlocal"
static = 0.3
kinetic = 0.15
bond_length = "2 um"
rest_growth = "2e-6 m/s^2"
rest_speed = "1 um/s"
[slide]
kind = "dwell"
speed = "1 mm/s"
"""


def dwell(hold: float, part: float, *more, steps: int = 2000) -> tuple:
    """Compute the friction force before a rest, at its end and at its peak after the rest.

    The force is divided by mu_s N; l_k = part eps_0, and the slide before the rest is steady.

    Parameters
    ----------
    hold : float
        Duration of the rest [s].
    part : float
        l_k / eps_0.
    *more : str
        Keys and values that replace others.
    steps : int
        Time steps.
    """
    sets = [
        f"slide.hold={float(hold)!r} s",
        f"slide.distance={(40 + 20 * part) * LENGTH!r} m",
        f"slide.distance_after={20 * LENGTH!r} m",
        f"friction.slip_growth={part * LENGTH!r} m",
        f"accuracy.steps_per_cycle={steps}",
        *more,
    ]
    found = law_bench.run_bench(build(scene.loads(SCENE, sets=sets)), None, steps)
    force = found.force / (STATIC * found.load[0])
    rest = np.flatnonzero(np.diff(found.slide) == 0)
    return force[rest[0]], force[rest[-1] + 1], force[rest[-1] + 1 :].max()


def aged(hold, part: float):
    """Return the bond length after a rest, relative to eps_0, in closed form."""
    slow = steady_bond_length(SPEED, LENGTH, RATIO, REST_GROWTH, part * LENGTH) / LENGTH
    return 1 - (1 - slow) * np.exp(-REST_GROWTH * np.asarray(hold) / FLOOR)


def main(
    holds=HOLDS,
    parts=(0.5, 5.0, 50.0),
    path: Path | None = FOLDER / "ageing.svg",
    steps: int = 2000,
) -> list:
    """Print one row for each l_k and rest.

    A row has the aged bond length, and the friction force before, at the end of and after the rest.
    """
    rows = [
        {
            "part": part,
            "hold": float(hold),
            "aged": float(aged(hold, part)),
            "reading": "stretch",
            **dict(zip(("before", "rested", "peak"), map(float, dwell(hold, part, steps=steps)))),
        }
        for part in parts
        for hold in holds
    ]
    printed = ("friction.reading=report", "friction.initial_bonds=0")
    rows += [
        {
            "part": 0.1,
            "hold": float(hold),
            "aged": float(aged(hold, 0.1)),
            "reading": "report",
            **dict(
                zip(("before", "rested", "peak"), map(float, dwell(hold, 0.1, *printed, steps=800)))
            ),
        }
        for hold in (holds[0], holds[-1])
    ]
    for row in rows:
        print(
            f"{row['reading']:<8} l_k = {row['part']:4g} eps_0, rest {row['hold']:7.3f} s: eps_d {row['aged']:.5f}, "
            f"force {row['before']:.5f} -> {row['rested']:.5f}, peak {row['peak']:.5f}"
        )
    if path is not None:
        _draw(path, rows, parts)
    return rows


def _draw(path: Path, rows: list, parts) -> None:
    """Plot the peak of the stretch reading against the duration of the rest, with the closed form of the bond length."""
    time = 10.0 ** np.linspace(-2, 1, 121)
    with drawing(path, (6.4, 3.6)) as (_, axis):
        axis.semilogx(
            time, aged(time, parts[-1]), color="0.2", label="bond length over ε₀ (2.10 at rest)"
        )
        for part, colour in zip(parts, (GREY, ORANGE, BLUE)):
            mine = [row for row in rows if row["part"] == part]
            axis.semilogx(
                [row["hold"] for row in mine],
                [row["peak"] for row in mine],
                "o-",
                color=colour,
                ms=4,
                label=f"peak, slip growth {part:g} ε₀",
            )
        axis.set(
            xlabel="rest [s]",
            ylabel="friction over μₛ N",
            title="Peak after a rest",
            ylim=(0.45, 1.05),
        )
        axis.legend()


if __name__ == "__main__":
    run_study(main)
