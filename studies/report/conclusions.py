"""Do the ten conclusions of the report hold, in numbers that can be computed or read off its own Table 1?

Six hold (1, 3, 5, 7, 8, 10), four in part: 2, as damping of 0.003 limits the motion too, at 218 mil; 4, as only a block
that runs away moves as a sine; 6, as slip begins 47 degrees before the input's maximum; 9, as the exact velocity stops
without a jump, only the acceleration has one.

`conclusions.md` has every claim in short, what is found and the number, written by this study. The block is that of
Figs 2 and 3: one mode at 143 Hz, an onset of 4.14 g, a damping ratio of 0.003.

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
from told import told

import patchfem as pf
from patchfem.response.measures import harmonic

HERE = Path(__file__).parent
QUESTION, ANSWER = told(__doc__)
REPRODUCED = ""
G, MIL, ONSET = 9.80665, 25.4e-6, 4.14
ONSETS = {135: (3.8, 4.2), 143: (3.9, 4.0), 150: (4.0,), 155: (4.2,)}  # Table 1, both series [g]
HOLDS, PART = "holds", "in part"


class Conclusion(NamedTuple):
    """One of the ten: number, the claim in short, verdict, and what was found."""

    number: int
    claim: str
    verdict: str
    found: str


@lru_cache
def block(level: float, frequency: float = 143.0, **sets) -> tuple:
    """(Result, {measure: value}) of the steady block at a level [g]."""
    found = pf.run(HERE / "block.toml", **sets, **{"drive.acceleration": level * G, "drive.frequency": frequency})
    return found, {name: one.value for name, one in found.measures.items()}


def phases(level: float) -> tuple:
    """(release, stop) of the block as phases of the input displacement [deg], from 0 to 180."""
    value = block(level)[1]
    release = np.degrees(value["slip_start_phase"])
    return release, release + 180 * (1 - value["stick_fraction"])


def first() -> Conclusion:
    pairs = [(f, onset) for f, read in ONSETS.items() for onset in read]
    f, onset = np.log(np.array(pairs, float)).T
    line = linregress(f, onset)
    half = t.ppf(0.975, f.size - 2) * line.stderr
    held = [f for f in ONSETS if block(0.999 * ONSET, f)[0].outcome == "stuck" != block(1.001 * ONSET, f)[0].outcome]
    return Conclusion(1, "slip begins at one level, whatever the frequency", HOLDS,
                      f"the six onsets of Table 1 are {np.exp(onset.mean()):.2f} g with a spread of "
                      f"{100 * onset.std(ddof=1):.1f} %; they go with the frequency to the power {line.slope:.1f} ± "
                      f"{half:.1f} (95 %), and two series at 135 Hz differ as much as all frequencies. A Coulomb "
                      f"block begins at mu N/m at {', '.join(map(str, held))} Hz alike")


def second() -> Conclusion:
    value = block(8.0)[1]
    push = np.sqrt(8**2 - (4 * ONSET / np.pi)**2) * G * 0.8546
    cubic = 4 / 3 * push / (10 * MIL)**3
    share = 0.75 * cubic * (10 * MIL)**2 / (0.8546 * (2 * np.pi * 143)**2)
    return Conclusion(2, "above a level the motion diverges, limited by the stiffening of the flexures alone", PART,
                      f"it does for a rigid block from {knee():.2f} g on, and for one that climbs 80 um grooves at 8.0 "
                      "g; but a damping ratio of 0.003 limits the block too, at 8 g at "
                      f"{value['relative_displacement_amplitude'] / MIL:.0f} mil. Flexures that are {100 * share:.0f} "
                      "% stiffer over a cycle of 10 mil limit it there")


@lru_cache
def knee() -> float:
    """Level [g] above which the block slides without a stop, by halving."""
    low, high = 5.0, 6.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if block(middle)[1]["stick_fraction"] > 0 else (low, middle)
    return low


@lru_cache
def jump() -> float:
    """Jump of the block's acceleration when it stops, at 5 g, over the input's."""
    return float(np.abs(np.diff(exact_cycle(ONSET).relative)).max())


def third() -> Conclusion:
    scene = figure_27.scene("second path").replace("cycles = 800", "cycles = 300")
    value = pf.run(scene, **{"drive.acceleration": 5 * G}).measures
    return Conclusion(3, "sticking and slipping strike the mass, which rings at higher frequencies", HOLDS,
                      f"the acceleration of the block jumps by {5 * jump():.1f} g when it stops at 5 g; where the "
                      "contact gives by 0.243 um before it slips, as in the best model of Table 1, the block rings at "
                      f"{value['ring_frequency'].value / 1e3:.1f} kHz with a damping ratio of "
                      f"{value['ring_damping'].value:.2f}")


def fourth() -> Conclusion:
    share = {level: block(level)[1]["acceleration_distortion"] for level in (5.25, 5.5, 6.0)}
    moved = block(6.0)[1]["relative_displacement_amplitude"] / MIL
    return Conclusion(4, "responses can be nearly sinusoidal above certain levels", PART,
                      "the third harmonic of the block's acceleration is " + ", ".join(
                          f"{one:.2f} of the first at {level:g} g" for level, one in share.items())
                      + f", but there it moves {moved:.0f} mil. One that climbs grooves and stays below 1 mil, as the "
                      "rig did, gets less sinusoidal: 0.23 at 5 g, 0.35 at 8 g")


def fifth() -> Conclusion:
    text = (HERE.parent / "rig" / "rig.toml").read_text("utf-8")
    found = pf.run(text[:text.index("[contact.shear]")], **{"contact.tilt.angle": "29 urad"}).measures
    return Conclusion(5, "only a portion of the area rubbed, for want of alignment", HOLDS,
                      f"{100 * found['contact_fraction'].value:.0f} % of the patch touch where one piece is tilted by "
                      f"29 urad, {0.029 * 12.7:.2f} um over 12.7 mm, in a rigid fixture")


def sixth() -> Conclusion:
    release, stop = phases(5.0)
    return Conclusion(6, "slip begins near the input's maximum and is largest somewhat later", PART,
                      f"at 5 g it begins {90 - release:.0f} degrees before the maximum of the input displacement; it "
                      f"is largest {stop - 90:.0f} degrees after it")


def seventh() -> Conclusion:
    release, stop = phases(5.0)
    levels = [level for level in np.arange(4.2, 5.3, 0.1) if phases(float(level))[1] < 180 < 180 + phases(
        float(level))[0]]
    return Conclusion(7, "the masses are stuck while the input displacement returns through zero", HOLDS,
                      f"at 5 g from {stop:.0f} to {180 + release:.0f} degrees; so at every level of 0.1 g from "
                      f"{levels[0]:.1f} to {levels[-1]:.1f} g, and no more from {knee():.2f} g on, where no stop is "
                      "left")


def eighth() -> Conclusion:
    window = block(5.0)[0].window
    weight = np.gradient(window.time)
    block_of, base = (harmonic(window.time, weight, one, 2 * np.pi * 143)
                    for one in (window.acceleration, window.base_acceleration))
    lag = -np.degrees(np.angle(block_of / base))
    return Conclusion(8, "the masses slip again and follow the input, lagging", HOLDS,
                      f"at 5 g the block slips again at {180 + phases(5.0)[0]:.0f} degrees, and the first harmonic of "
                      f"its motion lags by {lag:.0f} degrees")


def ninth() -> Conclusion:
    exact, stopped = exact_cycle(ONSET), newmark_run(STICK_SPEED)
    drops = [float(np.abs(np.diff(one.velocity)).max()) for one in (exact, stopped)]
    return Conclusion(9, "at sticking the velocity drops from a finite value, which makes the acceleration jump", PART,
                      f"the acceleration jumps by {jump():.2f} of the input's; the velocity does not: from one of 400 "
                      f"samples to the next it changes by {drops[0]:.3f} of the input's at most, as everywhere. By "
                      f"Newmark's method with a stick speed it drops by {drops[1]:.2f}: an artefact")


def tenth() -> Conclusion:
    turns = figure_5.turns(figure_5.motion()).size
    return Conclusion(10, "the analysis shows no ringing, as its model has one degree of freedom", HOLDS,
                      "a stuck block has nothing left that moves, and a sliding one swings at the frequency that "
                      f"drives it; driven at a tenth of that the same model does ring, with {turns} turns a cycle "
                      "(Fig. 5)")


ALL = (first, second, third, fourth, fifth, sixth, seventh, eighth, ninth, tenth)


def table(found: list) -> str:
    """The conclusions as a table in Markdown."""
    rows = "\n".join(f"| {one.number} | {one.claim} | {one.verdict} | {one.found} |" for one in found)
    return ("# The ten conclusions of the report\nWritten by `conclusions.py`.\n\n| | claim, in short | holds? | found "
            f"|\n|---|---|---|---|\n{rows}\n")


def main(path: Path | None = HERE / "conclusions.md") -> list:
    """[Conclusion], printed and written as a table."""
    found = [one() for one in ALL]
    for one in found:
        print(f"{one.number:2} {one.verdict:8} {one.claim}: {one.found}")
    if path is not None:
        path.write_text(table(found), "utf-8")
    print(ANSWER)
    return found


if __name__ == "__main__":
    main()
