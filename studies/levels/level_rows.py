"""A rig driven at levels that rise and fall: one row of onset, jumps and hysteresis for each contact."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from rig_texts import STUDIES, TEXTS

from patchfem.core import G_N, BaseSine
from patchfem.dynamics.harmonic.branch import levels as follow
from patchfem.dynamics.harmonic.forces import Group
from patchfem.dynamics.harmonic.laws import Spring
from patchfem.model.model import build
from patchfem.runs import run as runner
from patchfem.runs.rig.interface import contact_model
from patchfem.runs.rig.numerics import choose
from patchfem.scene import scene

MIL, FLOOR = 25.4e-6, 0.01  # FLOOR: least displacement that Table 1 reads [mil]
UP = np.arange(3.0, 5.01, 0.25)  # g
STIFF_UP = np.arange(5.0, 7.01, 0.125)
CYCLES = 200  # of every level
HARMONICS = 7
RIG = (STUDIES / "rig" / "rig.toml").read_text()
BONDS_OF_RIG = RIG[RIG.index("[friction]"):RIG.index("[structure]")]
STIFFENED = (STUDIES / "steady" / "stiffened.toml").read_text()


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
    drive = f'[drive]\nkind = "base"\nwaveform = "levels"\nfrequency = "{frequency} Hz"\nlevels = [{rows}]\n' \
        'onset = "slip"\n'
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
               None if onset is None else (onset.value / G_N, (onset.error or 0.0) / G_N),
               seen_from(listed, slip, up.size),
               (largest_step(listed, slip, slice(0, up.size)), largest_step(listed, slip, slice(up.size - 1, None))),
               loop.value, folds)


def seen_from(levels, slip, count: int) -> float:
    """Where slip passes the floor of the readings on the way up, between levels by its logarithm."""
    k = int(np.argmax(slip[:count] > FLOOR * MIL))
    if k == 0:
        return float("nan") if slip[0] <= FLOOR * MIL else float(levels[0])
    low, high = np.log(np.maximum(slip[k - 1:k + 1], 1e-3 * FLOOR * MIL))
    return float(np.interp(np.log(FLOOR * MIL), [low, high], levels[k - 1:k + 1]))


def largest_step(levels, slip, part) -> tuple:
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
    return tuple(f / G_N for f in follow(modes, drive, group, up[[0, -1]] * G_N, harmonics=HARMONICS).folds)
