"""From which level of the input on does each model of the rig slip, by which criterion, at which frequency?

Criterion and law matter more than the frequency. The report says that slip begins at 4 g at all frequencies; its operators
saw the acceleration distorted, at 3.8 to 4.2 g (Table 1). By distortion a rigid block of the same friction over mass slips
from 4.25 to 4.26 g on and the shipped patch with an elastic-plastic law from 4.08 to 4.11 g on, at any of the four
frequencies; with bonds, as shipped, from 3.39 g on at 135 Hz and from 2.96 g on at 155 Hz. Under the law of bonds part of
the force is irreversible from the first motion on: slip begins at 0.19 g, where the elastic-plastic patch needs 3.86 g and
the rigid block 4.00 g. The block of block.toml has another mass, so that mu N/m is 4.14 g there.

The criteria are those of the key `drive.onset`: first irreversible slip (of an elastic interface more than a thousandth of
its elastic range); third harmonic of the acceleration above 3 % of the first, which is what an operator sees; half the
peak-to-peak motion of the block above 0.01 mil, the smallest reading of the gauge, which elastic motion reaches too. The
level rises in steps, the state is carried over, and the step with the onset is halved five times.

Run: python studies/report/onset.py
"""

import re
import sys
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from study_run import run_study
from study_text import read_answer

import patchfem as pf
from patchfem.core import G_N

FOLDER = Path(__file__).parent
STUDIES = FOLDER.parent
ANSWER = read_answer(__doc__)
VERDICT = ""
FREQUENCIES = (135, 143, 150, 155)  # [Hz] of Table 1
MEASURED_LEVELS = {
    135: "3.8, 4.2",
    143: "3.9, 4.0",
    150: "4.0",
    155: "4.2",
}  # [g], both series of Table 1
LEVELS = (0.1, 0.25, 0.5, *(0.5 * k for k in range(2, 11)))  # [g] steps of the input
CRITERIA = {
    "slip": {"drive.onset": "slip"},
    "distortion": {"drive.onset": "distortion"},
    "gauge": {"drive.onset": "gauge", "drive.onset_length": "0.01 mil"},
}
MODELS = {  # scene and settings of each model
    "rigid block, Coulomb": ("report/block.toml", {"structure.moving_mass": "0.884 kg"}),
    "shipped patch, bonds": ("rig/rig.toml", {}),
    "shipped patch, elastic-plastic": ("rig/rig.toml", {"friction.law": "elastic-plastic"}),
    "patch beside a second path": ("table_1/second_path.toml", {}),
    "block on grooves": ("table_1/grooves.toml", {}),
}


class Onset(NamedTuple):
    """Level of the input [g] from which on a model slips, with its error; None where it does not up to 5 g."""

    model: str
    criterion: str
    frequency: int
    level: float | None
    error: float | None


def find_onset(model: str, criterion: str, frequency: int) -> Onset:
    """Compute the onset of slip.

    Parameters
    ----------
    model, criterion : str
        Keys of `MODELS` and `CRITERIA`.
    frequency : int
        [Hz]

    Returns
    -------
    Onset
    """
    path, sets = MODELS[model]
    text = (STUDIES / path).read_text("utf-8").partition("[measured]")[0]
    levels = ", ".join(f'"{level:g} g"' for level in LEVELS)
    text = re.sub(r'acceleration = "5 g".*', f"levels = [{levels}]", text)
    drive = {"drive.waveform": "levels", "drive.frequency": f"{frequency} Hz"}
    result = pf.run(text, **drive, **{"accuracy.method": "auto"}, **CRITERIA[criterion], **sets)
    found = result.measures.get("onset_level")
    if found is None or found.value is None:
        return Onset(model, criterion, frequency, None, None)
    return Onset(model, criterion, frequency, found.value / G_N, found.error / G_N)


def format_level(found: Onset) -> str:
    """Return the level in g, with its error unless this is below the last digit."""
    if found.level is None:
        return "above 5"
    return f"{found.level:.2f}" + (f" ± {found.error:.2f}" if found.error >= 0.005 else "")


def make_table(onsets: list[Onset]) -> str:
    """Return the page in Markdown: a row for each model and criterion, a column for each frequency."""
    heads = " | ".join(f"{frequency} Hz" for frequency in FREQUENCIES)
    lines = [
        "# Onset of slip by model, criterion and frequency",
        "`onset.py` generates this page. The numbers are levels of the base acceleration in g at which slip begins by a "
        "criterion: `slip`, an interface slips irreversibly; `distortion`, the third harmonic of the acceleration exceeds "
        "3 % of the first; `gauge`, the block moves by more than 0.01 mil to each side. ± is half the distance of the "
        "levels before and after the onset, if it is at least 0.005 g. " + ANSWER,
        "",
        f"| model | criterion | {heads} |",
        "|---|---|" + "---|" * len(FREQUENCIES),
        "| **measured (Table 1)** | distortion, seen | "
        + " | ".join(MEASURED_LEVELS[frequency] for frequency in FREQUENCIES)
        + " |",
    ]
    for model in MODELS:
        for criterion in CRITERIA:
            cells = [format_level(one) for one in onsets if one[:2] == (model, criterion)]
            lines.append(f"| {model} | {criterion} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main(path: Path | None = FOLDER / "onset.md") -> list[Onset]:
    """Print the onsets, write them as a page if a path is given, and return them."""
    onsets = []
    for model in MODELS:
        for criterion in CRITERIA:
            for frequency in FREQUENCIES:
                found = find_onset(model, criterion, frequency)
                onsets.append(found)
                print(f"{model}, {criterion}, {frequency} Hz: {format_level(found)} g", flush=True)
    if path is not None:
        path.write_text(make_table(onsets), "utf-8")
    return onsets


if __name__ == "__main__":
    run_study(main)
