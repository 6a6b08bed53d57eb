"""How much of the patch rubs, against misalignment? `misalignment.svg`: by the fixture, bare, and by the skin, rigid.

Run: python studies/misalignment/picture.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import fixtures
import tilted
from drawing import BLUE, GREY, ORANGE, drawing
from study_run import run_study

from patchfem.runs.patch.press import solve_patch_contact

FOLDER = Path(__file__).parent
TILTS = 10.0 ** np.linspace(-6, -2, 61)
FIXTURES = {None: "rigid", 1e4: "10 kN m/rad", 1e3: "1 kN m/rad", 1e2: "100 N m/rad"}
SKINS = {
    "bare": "none: smooth pieces",
    "linear": "linear, 1e13 Pa/m",
    "peaks": "peaks, scatter 0.2 um",
    "exponential": "exponential, 2.5 um",
}
COLOURS = (BLUE, "#4f9bd9", "#e0975f", ORANGE)


def portions(spring, skin: str, tilts=TILTS) -> np.ndarray:
    """Return the rubbed portion at each misalignment [rad] of a holder."""
    return np.array(
        [
            tilted.rubbed_portion(
                solve_patch_contact(fixtures.held_pieces(tilt, spring, skin), tilted.pair(1))
            )
            for tilt in tilts
        ]
    )


def main(path: Path = FOLDER / "misalignment.svg", tilts=TILTS) -> Path:
    """Draw both panels and return the path of the file."""
    with drawing(path, (9.6, 3.6), 1, 2, sharey=True) as (_, (left, right)):
        for axis, title, curves in (
            (left, "smooth, holder", [(s, "bare", text) for s, text in FIXTURES.items()]),
            (right, "rigid, skin", [(None, skin, text) for skin, text in SKINS.items()]),
        ):
            for colour, (spring, skin, text) in zip(COLOURS, curves, strict=True):
                axis.semilogx(
                    1e3 * tilts, 100 * portions(spring, skin, tilts), color=colour, label=text
                )
            axis.axhline(50, color=GREY, lw=0.8, ls=":")
            axis.set(xlabel="misalignment [mrad]", xlim=(1e-3, 10), ylim=(0, 103))
            axis.legend(title=title, alignment="left", loc="lower left")
            above = axis.secondary_xaxis(
                "top", functions=(lambda m: 12.7 * m, lambda um: um / 12.7)
            )
            above.set_xlabel("height over the patch [um]")
        left.set_ylabel("rubbed part of the patch [%]")
    return path


if __name__ == "__main__":
    run_study(main)
