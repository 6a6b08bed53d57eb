"""Do computed numbers and Table 1 of the report support the ten conclusions of the report?

Six hold fully (1, 3, 5, 7, 8, 10) and four partly. Conclusion 2: not only stiffening limits the motion; a damping ratio
of 0.003 alone limits the amplitude to 218 mil. Conclusion 4: only a block that runs away moves as a sine. Conclusion 6:
slip begins 47 degrees before the input's maximum. Conclusion 9: the exact velocity reaches zero without a jump; only
the acceleration jumps.

`reproduced.md` has every claim in short and what is found. The block is that of
Figs 2 and 3, the rigid Coulomb block of block.toml and not the patch of the shipped rig.toml: one mode at 143 Hz, an
onset of 4.14 g, a damping ratio of 0.003.

Run: python studies/report/conclusions.py
"""

import sys
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import linregress, t

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import figure_5
import figure_27
from figures_2_3 import STICK_SPEED, exact_cycle, newmark_run
from study_run import run_study
from study_text import read_answer

import patchfem as pf
from patchfem.measures.measures import compute_harmonic

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = ""
G = 9.80665  # [m/s^2] standard gravity
MIL = 25.4e-6  # [m] one thousandth of an inch
ONSET = 4.14  # [g] at which the block begins to slip
# [g] onsets of slip in both series of Table 1
ONSETS = {135: (3.8, 4.2), 143: (3.9, 4.0), 150: (4.0,), 155: (4.2,)}
HOLDS = "holds"  # verdict of a conclusion that holds
PART = "in part"  # verdict of a conclusion that holds in part


class Conclusion(NamedTuple):
    """One of the ten conclusions: number, short claim, verdict, and result."""

    number: int
    claim: str
    verdict: str
    found: str


@lru_cache
def block(level: float, frequency: float = 143.0, **sets) -> tuple:
    """Compute the steady block at a level [g]; return the result and its measures by name."""
    found = pf.run(
        FOLDER / "block.toml",
        **sets,
        **{"drive.acceleration": level * G, "drive.frequency": frequency},
    )
    return found, {name: one.value for name, one in found.measures.items()}


def phases(level: float) -> tuple:
    """Return the phases of the input displacement at which the block slips and stops, 0 to 180 degrees."""
    value = block(level)[1]
    release = np.degrees(value["slip_start_phase"])
    return release, release + 180 * (1 - value["stick_fraction"])


def first() -> Conclusion:
    pairs = [(f, onset) for f, read in ONSETS.items() for onset in read]
    f, onset = np.log(np.array(pairs, float)).T
    line = linregress(f, onset)
    half = t.ppf(0.975, f.size - 2) * line.stderr
    held = [
        f
        for f in ONSETS
        if block(0.999 * ONSET, f)[0].outcome == "stuck" != block(1.001 * ONSET, f)[0].outcome
    ]
    return Conclusion(
        1,
        "slip begins at the same level at all frequencies",
        HOLDS,
        f"The six onsets of slip in Table 1 have the mean {np.exp(onset.mean()):.2f} g and a standard "
        f"deviation of {100 * onset.std(ddof=1):.1f} %. A fitted power law of the frequency has the "
        f"exponent {line.slope:.1f} ± {half:.1f} (95 %). The onsets of the two series at 135 Hz "
        "differ as much as the onsets at all frequencies do. The rigid block of block.toml begins to slip at "
        f"the same level, mu N/m = {ONSET} g, at {', '.join(map(str, held))} Hz. The patch of rig.toml slips part by "
        "part and does not: the third harmonic of its acceleration exceeds 3 % from 3.39 g on at 135 Hz and from "
        "2.96 g on at 155 Hz.",
    )


def second() -> Conclusion:
    value = block(8.0)[1]
    push = np.sqrt(8**2 - (4 * ONSET / np.pi) ** 2) * G * 0.8546
    cubic = 4 / 3 * push / (10 * MIL) ** 3
    share = 0.75 * cubic * (10 * MIL) ** 2 / (0.8546 * (2 * np.pi * 143) ** 2)
    return Conclusion(
        2,
        "above a certain level the motion diverges; only the stiffening of the flexures limits it",
        PART,
        f"A rigid block diverges from {knee():.2f} g on, and a block that climbs 80 um grooves "
        "at 8.0 g. But a damping ratio of 0.003 limits the rigid block too: at 8 g its amplitude "
        f"is {value['relative_displacement_amplitude'] / MIL:.0f} mil. To limit the block to 10 mil, the "
        f"flexures would have to be {100 * share:.0f} % stiffer in a cycle of this amplitude "
        "than in small cycles.",
    )


@lru_cache
def knee() -> float:
    """Return the level [g] above which the block slides without a stop, by bisection."""
    low = 5.0
    high = 6.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if block(middle)[1]["stick_fraction"] > 0 else (low, middle)
    return low


@lru_cache
def jump() -> float:
    """Return the jump of the block's acceleration when it stops, at 5 g, relative to that of the input."""
    return float(np.abs(np.diff(exact_cycle(ONSET).relative)).max())


def third() -> Conclusion:
    plan = pf.plan(figure_27.scene("second path"))
    stuck = max(mode["stuck_frequency"] for mode in plan.modes(plan.chain))
    return Conclusion(
        3,
        "the impacts of sticking and slipping make the mass ring at higher frequencies",
        HOLDS,
        f"At a level of 5 g the acceleration of the block jumps by {5 * jump():.1f} g when the block "
        "stops. If the contact deforms by 0.243 um before it slips, as in the best model of Table 1, the "
        f"block rings at {stuck / 1e3:.1f} kHz.",
    )


def fourth() -> Conclusion:
    share = {level: block(level)[1]["acceleration_distortion"] for level in (5.25, 5.5, 6.0)}
    moved = block(6.0)[1]["relative_displacement_amplitude"] / MIL
    return Conclusion(
        4,
        "responses can be nearly sinusoidal above certain levels",
        PART,
        "The third harmonic of the block's acceleration, divided by the first, is "
        + ", ".join(f"{one:.2f} at {level:g} g" for level, one in share.items())
        + f". But at 6 g the block moves by {moved:.0f} mil. If a block climbs grooves and moves by less "
        "than 1 mil, as the rig did, this ratio increases with the level: 0.23 at 5 g, 0.35 at 8 g.",
    )


def fifth() -> Conclusion:
    text = (FOLDER.parent / "rig" / "rig.toml").read_text("utf-8")
    found = pf.run(
        text[: text.index("[contact.shear]")], **{"contact.tilt.angle": "29 urad"}
    ).measures
    return Conclusion(
        5,
        "only a portion of the area rubbed, because the pieces were not well aligned",
        HOLDS,
        f"With a rigid fixture, {100 * found['contact_fraction'].value:.0f} % of the patch is in contact "
        f"if one piece is tilted by 29 urad ({0.029 * 12.7:.2f} um over 12.7 mm).",
    )


def sixth() -> Conclusion:
    release, stop = phases(5.0)
    return Conclusion(
        6,
        "slip begins near the input's maximum and is largest somewhat later",
        PART,
        f"At 5 g slip begins {90 - release:.0f} degrees before the maximum of the input displacement. "
        f"The slip is largest {stop - 90:.0f} degrees after this maximum.",
    )


def seventh() -> Conclusion:
    release, stop = phases(5.0)
    levels = [
        level
        for level in np.arange(4.2, 5.3, 0.1)
        if phases(float(level))[1] < 180 < 180 + phases(float(level))[0]
    ]
    return Conclusion(
        7,
        "the masses are stuck while the input displacement returns through zero",
        HOLDS,
        f"At 5 g the block is stuck from {stop:.0f} to {180 + release:.0f} degrees; the input is zero at "
        f"180 degrees. The block is stuck at this phase at every level from {levels[0]:.1f} to "
        f"{levels[-1]:.1f} g (in steps of 0.1 g). From {knee():.2f} g on the block never stops.",
    )


def eighth() -> Conclusion:
    window = block(5.0)[0].window
    weight = np.gradient(window.time)
    block_of, base = (
        compute_harmonic(window.time, weight, one, 2 * np.pi * 143)
        for one in (window.acceleration, window.base_acceleration)
    )
    lag = -np.degrees(np.angle(block_of / base))
    return Conclusion(
        8,
        "the masses slip again and follow the input, lagging",
        HOLDS,
        f"At 5 g the block slips again at {180 + phases(5.0)[0]:.0f} degrees. The first harmonic of its "
        f"motion lags by {lag:.0f} degrees behind the input.",
    )


def ninth() -> Conclusion:
    exact = exact_cycle(ONSET)
    stopped = newmark_run(STICK_SPEED)
    drops = [float(np.abs(np.diff(one.velocity)).max()) for one in (exact, stopped)]
    return Conclusion(
        9,
        "when the mass sticks, its velocity drops from a finite value, so the acceleration jumps",
        PART,
        f"The acceleration jumps by {jump():.2f} times the amplitude of the input acceleration. "
        "The velocity does not jump: between two neighbouring samples (400 per cycle) the velocity never "
        f"changes by more than {drops[0]:.3f} times the amplitude of the input velocity. With Newmark's "
        f"method and a stick speed the velocity drops by {drops[1]:.2f} times this amplitude, which is "
        "an artefact of the method.",
    )


def tenth() -> Conclusion:
    turns = figure_5.turns(figure_5.motion()).size
    return Conclusion(
        10,
        "the analysis shows no ringing, because its model has one degree of freedom",
        HOLDS,
        "A stuck block has no part left that could move, and a sliding block swings at its natural "
        "frequency, which is also the drive frequency. Driven at a tenth of its natural frequency, the "
        f"same model does ring: the block reverses {turns} times a cycle (Fig. 5).",
    )


ALL = (first, second, third, fourth, fifth, sixth, seventh, eighth, ninth, tenth)


def main() -> list:
    """Print the conclusions and return them."""
    found = [one() for one in ALL]
    for one in found:
        print(f"{one.number:2} {one.verdict:8} {one.claim}: {one.found}")
    print(ANSWER)
    return found


if __name__ == "__main__":
    run_study(main)
