"""What comes out for every number, figure and conclusion that the report prints?

The page `reproduced.md`, which this program writes, has the printed value, the computed one with its numerical error, the
study and a verdict of each, and the pictures of the figures. Of Table 1 it has two models: the shipped rig over 800 cycles,
of which two numbers are set by the onset of slip and by the modal test, and the patch beside a second path, fitted to
143 Hz. A computed number "agrees" if the larger of it and the printed one exceeds the smaller one by at most 12 %, by which
the report's own repeated readings differ; otherwise the verdict is the ratio of both.

The verdicts of figures and conclusions are those of their studies. The printed curves themselves are not part of this
repository, so that a figure is compared by what the report says of it.

Run: python studies/report/reproduce.py [--only PART]
"""

import io
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from importlib import import_module
from math import isnan, log, nan, pi
from os.path import relpath
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "integrators"))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from conclusions import ALL, ONSET, block
from items import ITEMS, VERDICTS
from onset import find_onset
from study_run import Option, run_study
from study_text import read_answer

import patchfem as pf
from patchfem.core import G_N, PatchfemError
from patchfem.inputs import read_table

FOLDER = Path(__file__).parent
STUDIES = FOLDER.parent
ANSWER = read_answer(__doc__)
VERDICT = ""
MIL = 25.4e-6  # [m] one thousandth of an inch
FOOT = 0.3048  # [m]
REPEATED_SCATTER = (
    0.12  # rms relative difference of the report's repeated readings, by report/repeats.py
)
ONSETS = {135: (3.8, 4.2), 143: (3.9, 4.0), 150: (4.0,), 155: (4.2,)}  # [g] of Table 1
RIGS = {  # models of Table 1: scene, and reading of the accelerometer over the true acceleration
    "shipped rig": ("rig/rig.toml", 1.0),
    "second path": ("table_1/second_path.toml", 1.2375),
}
FIGURES = {  # part: module of the study, figures of the report
    "figures-2-3": ("figures_2_3", "Figs 2, 3, 32, 33"),
    "figure-5": ("figure_5", "Figs 4, 5"),
    "figure-8": ("figure_8", "Fig. 8"),
    "figures-10-12": ("figures_10_12", "Figs 9 to 12"),
    "figure-13": ("figure_13", "Fig. 13"),
    "figure-14": ("figure_14", "Fig. 14"),
    "figure-15": ("figure_15", "Fig. 15"),
    "figures-16-22": ("failure", "Figs 16 to 22"),
    "figure-26": ("figure_26", "Fig. 26"),
    "figure-27": ("figure_27", "Fig. 27"),
    "figures-28-29": ("figures_28_29", "Figs 28, 29"),
    "figures-30-31": ("figures_30_31", "Figs 30, 31"),
}


class Row(NamedTuple):
    """Printed value or statement, and what comes out; `place` is its page, table or figure in the report."""

    place: str
    what: str
    printed: str
    computed: str
    error: str
    study: str
    verdict: str


def compare(place: str, what: str, printed: tuple, found: tuple, study: str) -> Row:
    """Compare a printed number with a computed one.

    Parameters
    ----------
    place, what, study : str
        Page or table of the report, name of the number, path of the study below studies/.
    printed : (float, str)
        Number and its unit.
    found : (float, float)
        Computed number and its numerical error, in this unit.

    Returns
    -------
    Row
    """
    value, error = found
    number, unit = printed
    ratio = value / number
    agrees = ratio > 0 and abs(log(ratio)) <= log(1 + REPEATED_SCATTER)
    bar = "not estimated" if isnan(error) else f"{error:.1g}"
    verdict = "agrees" if agrees else f"{ratio:.2g} times"
    return Row(
        place,
        what,
        f"{number:g} {unit}".rstrip(),
        f"{value:.4g} {unit}".rstrip(),
        bar,
        study,
        verdict,
    )


def scale(measure: pf.Measure, unit: float) -> tuple[float, float]:
    """Return value and error of a measure in a unit."""
    return measure.value / unit, measure.error / unit


def make_table_1() -> Iterator[Row]:
    """Compare every reading of Table 1 with two models; a run that fails has its reason."""
    readings = read_table(STUDIES / "rig/table1.csv")
    for model, (path, gain) in RIGS.items():
        found = {}
        for row in readings:
            condition = f"{row.frequency:g} Hz", f"{row.input / G_N:.3g} g"
            if condition not in found:
                sets = {"drive.frequency": condition[0], "drive.acceleration": condition[1]}
                try:
                    found[condition] = pf.run(STUDIES / path, **sets, **{"drive.cycles": 800})
                except PatchfemError as error:
                    yield Row(
                        "Table 1", ", ".join(condition), "", str(error), "", path, "not computed"
                    )
                    continue
            measures = found[condition].measures
            flag = {"U": ", unstable", "R": ", repeated"}.get(row.flag[:1], "")
            what = f"{model}, {', '.join(condition)}{flag}: "
            if row.acceleration:
                peak = scale(measures["absolute_acceleration_peak"], G_N / gain)
                printed = round(row.acceleration / G_N, 2), "g"
                yield compare("Table 1", what + "acceleration", printed, peak, path)
            if row.displacement:
                moved = scale(measures["relative_displacement_amplitude"], MIL)
                printed = round(row.displacement / MIL, 3), "mil"
                yield compare("Table 1", what + "displacement", printed, moved, path)


def make_onsets() -> Iterator[Row]:
    """Compare the onsets of Table 1 with the distortion of two models of the shipped rig."""
    for model in ("shipped patch, bonds", "shipped patch, elastic-plastic"):
        for frequency, levels in ONSETS.items():
            found = find_onset(model, "distortion", frequency)
            for level in levels:
                what = f"onset of slip at {frequency} Hz: {model}"
                pair = (found.level, found.error)
                yield compare("Table 1", what, (level, "g"), pair, "report/onset.py")


def make_block() -> Iterator[Row]:
    """Compare the numbers of 4.D with the rigid block, whose onset the report does not state."""
    study = "report/figures_2_3.py"
    base = 5 * G_N / (2 * pi * 143) ** 2
    yield compare(
        "4.D, p. 18", "base displacement at 5 g", (0.0002, "ft"), (base / FOOT, 0.0), study
    )
    for onset, mass in ((ONSET, "0.8546 kg"), (4.0, "0.8845 kg")):
        measures = block(5.0, 143.0, **{"structure.moving_mass": mass})[0].measures
        amplitude = measures["relative_displacement_amplitude"]
        what = f"at 5 g, slip from {onset:g} g on: "
        yield compare("4.D, p. 18", what + "amplitude q", (0.15, ""), scale(amplitude, base), study)
        inches = scale(amplitude, 0.0254)
        yield compare("4.D, p. 18", what + "amplitude", (0.00036, "in"), inches, study)
        peak = scale(measures["absolute_acceleration_peak"], G_N)
        yield compare("4.D, p. 18", what + "absolute acceleration", (5.0, "g"), peak, study)
    still, moved = (block(level)[0] for level in (4.0, 8.0))
    verdict = "agrees" if still.outcome == "stuck" else "differs"
    yield Row("4.D, p. 18", "at 4 g", "no slip", str(still.outcome), "", study, verdict)
    amplitude, error = scale(moved.measures["relative_displacement_amplitude"], MIL)
    found = f"{amplitude:.0f} mil, bounded by damping"
    yield Row("4.D, p. 18", "at 8 g", "divergence", found, f"{error:.1g}", study, "in part")


def find_picture(file: Path, folder: Path) -> Path:
    """Return the picture of a study in a folder; beside the study if it is that of the committed page."""
    return (file.parent if folder.resolve() == FOLDER.resolve() else folder) / f"{file.stem}.svg"


def make_figure(part: str, folder: Path | None) -> Iterator[Row]:
    """Run the study of a figure, draw it into a folder, and return its answer as a row."""
    name, figures = FIGURES[part]
    module = import_module(name)
    file = Path(module.__file__)
    found = module.main(path=None if folder is None else find_picture(file, folder))
    verdict, _, reason = module.VERDICT.partition(": ")
    answer = reason or read_answer(module.__doc__)
    study = file.relative_to(STUDIES).as_posix()
    yield Row(figures, "figure", "curves", answer, "", study, verdict)
    for place, what, printed, pair in FIGURE_NUMBERS.get(part, lambda _: [])(found):
        yield compare(place, what, printed, pair, study)


def list_release(found: tuple) -> Iterator[tuple]:
    """Return the times of rest of the released blocks, beside the 11 units of the report."""
    for row in found[0]:
        what = f"time of rest, natural frequency {row.omega:.3g}, k x0/F {row.ratio:g}"
        yield "3.C.1, p. 13", what, (11, ""), (row.stop, row.error)


def list_free_mode(found: tuple) -> Iterator[tuple]:
    """Return the mode fitted to a simulated modal test; the error is the rms misfit, of half the bandwidth."""
    frequency, damping, misfit = found[2]
    yield (
        "4.B, p. 16",
        "frequency of the axial mode",
        (143, "Hz"),
        (frequency, misfit * damping * frequency),
    )
    yield "4.B, p. 16", "its damping ratio", (0.003, ""), (damping, misfit * damping)


def list_loaded_modes(found: list) -> Iterator[tuple]:
    """Return the frequencies of the modes with friction that are critically damped within a third."""
    for row in found:
        if 0.67 < row.damping < 1.5:
            what = f"{row.model} at {row.level:g} g rms, damping ratio {row.damping:.2f}"
            yield "4.B, p. 16", what, (148, "Hz"), (row.frequency, nan)


def list_first_slips(found: list) -> Iterator[tuple]:
    """Return the friction under which mass 2 moves, with the largest violation of the law in accepted steps as error."""
    for row in found[0]:
        yield (
            "3.C.2, p. 14",
            f"friction [P0] as mass 2 moves: {row.name}",
            (3, ""),
            (row.force, row.worst),
        )


FIGURE_NUMBERS = {
    "figure-15": list_release,
    "figures-16-22": list_first_slips,
    "figure-26": list_free_mode,
    "figure-27": list_loaded_modes,
}


def make_conclusions() -> Iterator[Row]:
    """Return the ten conclusions with what is found."""
    for make in ALL:
        one = make()
        what = f"conclusion {one.number}"
        study = "report/conclusions.py"
        yield Row("5, p. 19", what, one.claim, one.found, "", study, one.verdict)


def list_parts(folder: Path | None) -> dict[str, Callable[[], Iterator[Row]]]:
    """Return the parts of the page by name; pictures go into the folder."""
    parts = {"table-1": make_table_1, "onset": make_onsets, "block": make_block}
    for name in FIGURES:
        parts[name] = lambda name=name: make_figure(name, folder)
    return parts | {"conclusions": make_conclusions}


def format_rows(rows: list[Row], folder: Path = FOLDER) -> list[str]:
    """Return a Markdown table of rows, for a page in a folder."""
    lines = [
        "| place | what | printed | computed | error | study | verdict |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        study = f"[{row.study}]({relpath(STUDIES / row.study, folder)})"
        lines.append(f"| {' | '.join(row[:5])} | {study} | {row.verdict} |")
    return lines


def make_page(found: dict[str, list[Row]], folder: Path) -> str:
    """Return the page of a folder in Markdown: a table for each part, and the pictures of figures."""
    counts = [sum(item.verdict.startswith(name) for item in ITEMS) for name in VERDICTS]
    texts = ", ".join(f"{name} {count}" for name, count in zip(VERDICTS, counts))
    lines = [
        "# What the report prints, and what comes out",
        "`python studies/report/reproduce.py` computes this page.",
        ANSWER,
        "",
    ]
    lines += [
        f"Of the [{len(ITEMS)} items of the report]({relpath(FOLDER / 'items.md', folder)}) the program computes: {texts}.",
        "",
    ]
    for part, rows in found.items():
        lines += [f"## {part}", *format_rows(rows, folder), ""]
        if part in FIGURES:
            picture = find_picture(STUDIES / rows[0].study, folder)
            lines += [f"![{FIGURES[part][1]}, computed]({relpath(picture, folder)})", ""]
        else:
            agreed = sum(row.verdict in ("agrees", "holds") for row in rows)
            lines += [f"{agreed} of {len(rows)} agree.", ""]
    return "\n".join(lines)


def main(only: str = "", path: Path | None = FOLDER / "reproduced.md") -> dict[str, list[Row]]:
    """Compute all parts, or one; print the rows, write the page if a path is given, and return the rows.

    The page of one part has its name (`table-1.md`), so that it does not replace the page of all.
    """
    parts = list_parts(None if path is None else path.parent)
    if only and only not in parts:
        raise PatchfemError(f"--only {only}: the parts are {', '.join(parts)}")
    found = {}
    for name in [only] if only else parts:
        print(f"{name} ...", file=sys.stderr, flush=True)
        found[name] = []
        with redirect_stdout(io.StringIO()):
            for row in parts[name]():
                found[name].append(row)
                print(f"{row.what}: {row.printed}, computed {row.computed}", file=sys.stderr)
        print("\n".join(format_rows(found[name])), flush=True)
    if path is not None:
        path = path.with_name(f"{only}.md") if only else path
        path.write_text(make_page(found, path.parent), "utf-8")
    return found


if __name__ == "__main__":
    run_study(
        main, only=Option("", "one part: table-1, onset, block, conclusions, figure-5 and others")
    )
