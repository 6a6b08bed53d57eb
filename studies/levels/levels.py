"""The report's procedure, the level raised and lowered in steps at one frequency: where does slip begin, and where does
the motion jump?

The rig of studies/rig at 143 Hz, 3 to 5 g and back in steps of .25 g, 200 cycles each, state carried over; mu N/m =
4.00 g, measured onset 3.8 to 4.2 g. Onset by bisection (slip of a thousandth of a bond length): 4.002 g for a Coulomb
block, which is mu N/m, 4.018 g for an elastic-plastic one and 3.876 g for the tilted patch of it. Laws that slip from
the start have none: the Coulomb patch slips at its edge from .87 g, bonds are damaged at any level (.18 g). What a
gauge of .01 mil sees is another matter: slip from 4.17 to 4.23 g for all without bonds, the measured onset or just
above it; with bonds of 1 um from below 3 g, and .11 (point) and .09 mil (patch) of motion at 4 g, where .08 was read.

None of these jumps, and raised or lowered they give the same to 3e-3 mil. Nor does the stiffened rig at 143 Hz. At
147 Hz, right of its resonance, it does: raised it jumps between 6.25 and 6.375 g, lowered between 6 and 5.875 g, the
folds of its steady motions are at 6.263 and 5.920 g, and 39 mil lie between both ways.

Run: python studies/levels/levels.py
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[1] / "steady"))
from against_march import TEXTS

from patchfem.core import G_N, BaseSine
from patchfem.dynamics.harmonic.branch import levels as follow
from patchfem.dynamics.harmonic.forces import Group
from patchfem.dynamics.harmonic.laws import Spring
from patchfem.export.pictures import BLUE, GREY, ORANGE, STYLE
from patchfem.model.model import build
from patchfem.runs import run as runner
from patchfem.runs.rig.interface import contact_model
from patchfem.runs.rig.numerics import choose
from patchfem.scene import scene

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[1]
MIL, FLOOR = 25.4e-6, 0.01  # FLOOR: least displacement that Table 1 reads [mil]
MEASURED = (3.8, 4.2)  # onset on the rig [g]
UP = np.arange(3.0, 5.01, 0.25)  # g
STIFF_UP = np.arange(5.0, 7.01, 0.125)
CYCLES = 200  # of every level
HARMONICS = 7
RIG = (ROOT / "rig" / "rig.toml").read_text()
BONDS_OF_RIG = RIG[RIG.index("[friction]"):RIG.index("[structure]")]
STIFFENED = (ROOT / "steady" / "stiffened.toml").read_text()


def _rig(friction: str) -> str:
    return RIG.replace(BONDS_OF_RIG, f"[friction]\nstatic = 0.30\n{friction}\n")


CASES = {  # name: (scene up to [drive], frequency [Hz], levels up [g])
    "Coulomb": (TEXTS["Coulomb"], 143.0, UP), "elastic-plastic": (TEXTS["elastic-plastic"], 143.0, UP),
    "bonds": (TEXTS["bonds"], 143.0, UP), "patch, Coulomb": (_rig('law = "coulomb"'), 143.0, UP),
    "patch, elastic-plastic": (_rig('law = "elastic-plastic"\nbond_length = "1 um"'), 143.0, UP),
    "patch, bonds": (RIG, 143.0, UP), "stiffened, 143 Hz": (STIFFENED, 143.0, UP),
    "stiffened, 147 Hz": (STIFFENED, 147.0, STIFF_UP)}


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """A case. levels (k,) [g] up and down again, amplitude and slip (k,) [m] at the end of each; limit: mu N/m [g];
    onset: (level, half its bracket) by bisection [g], or None; seen: level at which slip passes 0.01 mil on the way up
    [g]; jumps: (level before, level after, factor) of the largest step on the way up and of that on the way down;
    hysteresis [m]; folds of the steady motions over the level [g], where they were asked for."""

    case: str
    levels: np.ndarray
    amplitude: np.ndarray
    slip: np.ndarray
    limit: float
    onset: tuple | None
    seen: float
    jumps: tuple
    hysteresis: float
    folds: tuple = ()


def scene_text(case: str, cycles: int, rows: str, method: str = "") -> str:
    """The case with [drive] in levels."""
    text, frequency, _ = CASES[case]
    drive = f'[drive]\nkind = "base"\nwaveform = "levels"\nfrequency = "{frequency} Hz"\nlevels = [{rows}]\n'
    return text[:text.index("[drive]")] + drive + f"cycles = {cycles}\n[accuracy]\n{method}"


def solve(case: str, cycles: int = CYCLES, steps: int = 400) -> Row:
    """March, or run from event to event, through all levels."""
    up = CASES[case][2]
    listed = np.concatenate([up, up[-2::-1]])
    pinned = "" if case == "Coulomb" else f'method = "march"\nsteps_per_cycle = {steps}\n'
    given = scene.loads(scene_text(case, cycles, ", ".join(f'"{g:.6g} g"' for g in listed), pinned))
    found = runner.run(runner.plan(given), estimate=False)
    levels = found.extra["levels"]
    amplitude, slip = (np.array([one.values[f"{name}_amplitude"] for one in levels])
                       for name in ("relative_displacement", "slip"))
    load = given.normal.load if given.normal is not None else given.contact.load
    onset, loop = found.measures.get("onset_level"), found.measures.get("level_hysteresis")
    folds = folds_of(case) if case == "stiffened, 147 Hz" else ()
    return Row(case, listed, amplitude, slip, given.friction.static * load / given.structure.moving_mass / G_N,
               None if onset is None else (onset.value / G_N, (onset.error or 0.0) / G_N), _seen(listed, slip, up.size),
               (_jump(listed, slip, slice(0, up.size)), _jump(listed, slip, slice(up.size - 1, None))),
               loop.value, folds)


def _seen(levels, slip, count: int) -> float:
    """Where slip passes the floor of the readings on the way up, between levels by its logarithm."""
    k = int(np.argmax(slip[:count] > FLOOR * MIL))
    if k == 0:
        return float("nan") if slip[0] <= FLOOR * MIL else float(levels[0])
    low, high = np.log(np.maximum(slip[k - 1:k + 1], 1e-3 * FLOOR * MIL))
    return float(np.interp(np.log(FLOOR * MIL), [low, high], levels[k - 1:k + 1]))


def _jump(levels, slip, part) -> tuple:
    """(level before, level after, factor) of the largest step of the slip."""
    levels, slip = levels[part], slip[part]
    k = int(np.abs(np.diff(slip)).argmax())
    return float(levels[k]), float(levels[k + 1]), float(slip[k:k + 2].max() / slip[k:k + 2].min())


def folds_of(case: str) -> tuple:
    """Folds of the steady motions between the ends of the levels [g]: where the lower branch ends, where the upper."""
    text, frequency, up = CASES[case]
    model = build(scene.loads(text))
    modes, drive = model.rig.modes, BaseSine(up[0] * G_N, 2 * np.pi * frequency)
    joint = contact_model(model, choose(model), None)
    group = Group(modes, [(0, joint), (modes.output, Spring(0.0, model.rig.cubic))])
    return tuple(f / G_N for f in follow(modes, drive, group, up[[0, -1]] * G_N, HARMONICS).folds)


def picture(rows: list, path: Path = HERE / "levels.svg") -> Path:
    """Slip over the level, raised and lowered."""
    with rc_context(STYLE):
        figure = Figure(figsize=(10.5, 5.0))
        FigureCanvasSVG(figure)
        axes = figure.subplots(2, 4).ravel()
        for axis, r in zip(axes, rows):
            top = int(r.levels.argmax())
            slip = np.maximum(r.slip, 1e-9) / MIL
            axis.semilogy(r.levels[:top + 1], slip[:top + 1], "^-", color=BLUE, ms=3.5, lw=1, label="raised")
            axis.semilogy(r.levels[top:], slip[top:], "v-", color=ORANGE, ms=3.5, lw=1, label="lowered")
            if r.folds:
                for fold in r.folds:
                    axis.axvline(fold, color=GREY, lw=0.8, ls=":")
            else:
                axis.axvspan(*MEASURED, color="#dddddd", zorder=0)
                axis.axvline(r.limit, color=GREY, lw=0.8, ls="--")
            axis.axhline(FLOOR, color=GREY, lw=0.6)
            axis.set_title(r.case, fontsize=9)
        for axis in axes[4:]:
            axis.set_xlabel("level [g]")
        for axis in axes[::4]:
            axis.set_ylabel("slip [mil]")
        axes[0].legend(fontsize=8)
        figure.savefig(path, metadata={"Date": None})
    return path


def main(cases=tuple(CASES), path: Path | None = HERE / "levels.svg", **how) -> list:
    """[Row], printed and drawn."""
    rows = [solve(case, **how) for case in cases]
    print(f"measured onset {MEASURED[0]} to {MEASURED[1]} g")
    for r in rows:
        onset = "never stuck" if r.onset is None else f"onset {r.onset[0]:.3f} g"
        print(f"{r.case:24} mu N/m {r.limit:.3f} g  {onset:16} seen from {r.seen:.2f} g  largest step up "
              f"x{r.jumps[0][2]:.3g} from {r.jumps[0][0]:g} to {r.jumps[0][1]:g} g, down /{r.jumps[1][2]:.3g} from "
              f"{r.jumps[1][0]:g} to {r.jumps[1][1]:g} g  "
              f"up less down {r.hysteresis / MIL:.2g} mil"
              + ("  folds " + ", ".join(f"{f:.3f}" for f in r.folds) if r.folds else ""))
    if path is not None:
        picture(rows, path)
    return rows


if __name__ == "__main__":
    main()
