"""The tables of the ladder as markdown: every rung under every reading, models without mechanics, folds, placebos.

A score is the root mean square of ln(computed/measured): of all readings / of accelerations / of displacements.

Run as a program it writes them into README.md, between its marks.
"""

import sys
from pathlib import Path
from textwrap import fill

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from fitting import KIND, better, intervals, read_records, training
from fitting import NULLS as RIVALS
from null_models import NULL_MODELS, fit_null_model
from rungs import FOLDER, PROTOCOLS, ROOT2, RUNGS, STUCK_READING, TABLE, variants
from study_run import run_study

from patchfem.campaigns.rows.cells import compute_rms_scores, read_response_table

UNITS = {
    "static": "",
    "stiffness": "MN/m",
    "damping": "kN s/m",
    "slide": "",
    "accelerometer": "",
    "load": "N",
    "amplitude": "um",
    "acceleration_gain": "",
    "share": "",
    "mass": "",
    "factor": "",
}
SIZES = {"stiffness": 1e-6, "damping": 1e-3, "amplitude": 1e6}
SHORT = {
    "static": "μ",
    "stiffness": "k",
    "damping": "c",
    "slide": "yaw arm",
    "accelerometer": "yaw in accelerometer",
    "load": "N",
    "amplitude": "A",
    "acceleration_gain": "gain",
    "share": "rods",
    "mass": "tips",
    "factor": "worn",
}
# printed names of models that differ from their keys
TITLES = {
    "damper, yaw seen": "damper, yaw in the accelerometer",
    "path of Fig. 27, yaw not seen": "path of Fig. 27, yaw not in the accelerometer",
}
# (model, kind of reading, earlier scores at 143 Hz, at 135 to 155 Hz and left out, number of starts)
EARLIER_LADDER = (
    ("spring and yaw", ROOT2, ".074 / .082 / .051", ".166 / .138 / .255", ".179 / .132 / .287", 8),
    (
        "second path",
        STUCK_READING,
        ".063 / .065 / .058",
        ".186 / .156 / .284",
        ".298 / .140 / .569",
        8,
    ),
    ("second path", ROOT2, ".084 / .097 / .041", ".172 / .125 / .303", ".246 / .129 / .456", 8),
    (
        "yaw in the accelerometer",
        STUCK_READING,
        ".062 / .063 / .060",
        ".179 / .144 / .287",
        ".146 / .097 / .249",
        8,
    ),
    (
        "yaw in the accelerometer",
        ROOT2,
        ".073 / .081 / .050",
        ".168 / .147 / .242",
        ".204 / .185 / .258",
        8,
    ),
    (
        "rigid Coulomb",
        "peak",
        "1.419 / .925 / 2.151",
        "1.305 / .524 / 2.852",
        "1.484 / .793 / 2.740",
        2,
    ),
    ("grooves", ROOT2, ".584 / .109 / 1.041", ".737 / .231 / 1.657", ".710 / .284 / 1.391", 4),
    (
        "grooves, lift and yaw",
        "fundamental x gain",
        ".078 / .088 / .048",
        ".166 / .132 / .269",
        ".200 / .149 / .317",
        3,
    ),
)
MARK = "<!-- {} -->"
NAMED_FITS = {
    "rigid": ("rigid Coulomb", "peak"),
    "patch": ("patch", "fundamental x gain"),
    "weight": ("weight on its cable", ROOT2),
    "spring": ("spring and yaw", ROOT2),
    "path": ("path of Fig. 27", STUCK_READING),
    "root": ("path of Fig. 27", ROOT2),
    "lift": ("grooves, lift and yaw", "fundamental x gain"),
    "damped": ("second path", STUCK_READING),
    "seen": ("yaw in the accelerometer", STUCK_READING),
}


def three(values: dict | None) -> str:
    """Format scores as "all / acceleration / displacement", with a dash for a missing one."""
    if values is None:
        return "-"
    return " / ".join("-" if values[name] is None else short(values[name]) for name in KIND)


def short(score: float) -> str:
    return f"{score:.3f}".lstrip("0")


def _read_folds(rows: dict, rung: str, reading: str) -> list | None:
    """Return the records of the four folds; None if one is missing."""
    folds = [rows.get((rung, reading, protocol, "")) for protocol in PROTOCOLS[1:]]
    return None if None in folds else folds


def left_logs(folds) -> np.ndarray:
    """Return the logarithms (n,) of every reading by the fit that did not use its frequency."""
    cells = read_response_table(TABLE)
    logs = np.full(cells.row.size, np.nan)
    for fold in folds:
        out = ~training(cells, fold["protocol"])
        logs[out] = np.array(fold["logs"], float)[out]
    return logs


def left_out(rows: dict, rung: str, reading: str) -> dict | None:
    """Return the scores of every reading by the fit that did not use its frequency; None if a fold is missing."""
    folds = _read_folds(rows, rung, reading)
    if folds is None:
        return None
    logs = left_logs(folds)
    return compute_rms_scores(read_response_table(TABLE), logs, np.ones(logs.size, bool))


def null_left(name: str) -> np.ndarray:
    """Return `left_logs` of a model without mechanics."""
    cells = read_response_table(TABLE)
    out = np.full(cells.row.size, np.nan)
    for protocol in PROTOCOLS[1:]:
        fold = training(cells, protocol)
        out[~fold] = fit_null_model(cells, name, fold)[0][~fold]
    return out


def numbers(row: dict) -> str:
    """Format the fitted numbers of a record with their names, and which end of its range a number reaches."""
    parts = []
    for key, value, end in zip(row["keys"], row["values"], row["at_bound"]):
        name = key.rpartition(".")[2]
        shown = (
            0.0
            if end == "low" and abs(value * SIZES.get(name, 1)) < 1e-3
            else value * SIZES.get(name, 1)
        )
        parts.append(
            f"{SHORT[name]} = {shown:.3g} {UNITS[name]}".strip()
            + (f" ({end} end of its range)" if end else "")
        )
    given = f"; not fitted: gain = {row['gain']:.4g}" if row["reading"] == STUCK_READING else ""
    return ", ".join(parts) + given


def rung_title(rung: str) -> str:
    """Return the printed name of a model."""
    return TITLES.get(rung, rung)


def starts_text(row: dict) -> str:
    """Format in how many searches a record found its minimum.

    A dagger marks a minimum that was found once, a double dagger one from earlier records.
    """
    text = f"{row['valleys']['best']} of {row['valleys']['starts']}"
    return text + " †" * (row["valleys"]["best"] < 2) + " ‡" * row.get("before", False)


def nulls() -> list:
    """Return rows (name, accelerations fitted, fitted to 143 Hz, held out, left out, all) of scores."""
    cells = read_response_table(TABLE)
    out = []
    seen = training(cells, "143")
    every = np.ones(cells.row.size, bool)
    for name in NULL_MODELS:
        logs, (whole, made) = (
            fit_null_model(cells, name, seen)[0],
            fit_null_model(cells, name, every),
        )
        out.append(
            (
                name,
                made["acceleration"],
                compute_rms_scores(cells, logs, seen),
                compute_rms_scores(cells, logs, ~seen),
                compute_rms_scores(cells, null_left(name), every),
                compute_rms_scores(cells, whole, every),
            )
        )
    return out


def tables(rows: dict) -> list:
    """Return Markdown lines of the records {(model, interpretation, protocol, placebo): record}."""
    return [
        *_rungs(rows),
        "",
        *_left_out_lines(rows),
        "",
        *_comparison_lines(rows),
        "",
        *_placebos(rows),
    ]


def _rungs(rows: dict) -> list:
    out = [
        "| model | accelerometer shows | number of fitted parameters: their values | starts that end in the best "
        "minimum | score at 143 Hz | score at 135, 150, 155 Hz | score with each frequency left out | score if "
        "fitted to all rows | computing time [s] |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, factor, fitted, held, left, whole in nulls():
        said = {
            "constant": "constant x input",
            "power_input": "constant x a power of the input",
            "power_input_frequency": f"constant x input^{factor['input']:.2f} x "
            f"frequency^{factor['frequency']:.2f}",
        }[name]
        out.append(
            f"| without mechanics: {said} "
            f"| | | | {three(fitted)} | {three(held)} | {three(left)} | {three(whole)} | |"
        )
    for rung, one in RUNGS.items():
        for reading in one.readings:
            row = rows.get((rung, reading, "143", ""))
            if row is None:
                out.append(f"| {rung_title(rung)} | {reading} | not run | | | | | | |")
                continue
            every = rows.get((rung, reading, "all", ""))
            out.append(
                f"| {rung_title(rung)} | {reading} | {len(row['values'])}: {numbers(row)} | {starts_text(row)} | "
                f"{three(row['fitted'])} | {three(row['others'])} | {_mark_scores(rows, rung, reading)} | "
                f"{three(every and every['fitted'])} | {row['seconds']:.0f} |"
            )
    return out


def _mark_scores(rows: dict, rung: str, reading: str) -> str:
    """Return the left-out scores, with a dagger if the best minimum of a fold was found only once."""
    folds = _read_folds(rows, rung, reading)
    once = folds and any(fold["valleys"]["best"] < 2 for fold in folds)
    return three(left_out(rows, rung, reading)) + (" †" if once else "")


def fully_folded(rows: dict) -> list:
    """List the (rung, reading) that have all folds, with their logarithms."""
    here = [
        (rung, reading, _read_folds(rows, rung, reading))
        for rung, one in RUNGS.items()
        for reading in one.each
    ]
    return [(rung, reading, folds, left_logs(folds)) for rung, reading, folds in here if folds]


def _left_out_lines(rows: dict) -> list:
    """Return lines for each left-out frequency.

    They have scores with bootstrap intervals, and how often resampled rows prefer the model.
    """
    cells = read_response_table(TABLE)
    every = np.ones(cells.row.size, bool)
    out = [
        "| model | accelerometer shows | score of all readings | score of accelerations | score of displacements | "
        "fraction of samples in which the model is better than the constant: all, accelerations, displacements | "
        "fraction of samples in which its accelerations are better than those of the power law | "
        "fits whose best minimum was found twice | parameters at an end of their range |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    null = {name: null_left(one) for name, one in RIVALS.items()}
    told = {"constant": "constant x input", "strong": "power law in input and frequency"}
    listed = [
        (f"without mechanics: {told[name]}", "", None, logs) for name, logs in null.items()
    ] + fully_folded(rows)
    for rung, reading, folds, logs in listed:
        own = compute_rms_scores(cells, logs, every)
        drawn = intervals(cells, logs, every)
        cellular = [
            f"{short(own[kind])} ({short(drawn[kind][0])} to {short(drawn[kind][1])})"
            for kind in KIND
        ]
        beats = (
            {name: better(cells, logs, other, every) for name, other in null.items()}
            if folds
            else None
        )
        of_constant = " / ".join(f"{beats['constant'][kind]:.2f}" for kind in KIND) if folds else ""
        of_strong = f"{beats['strong']['acceleration']:.2f}" if folds else ""
        twice = f"{sum(fold['valleys']['best'] > 1 for fold in folds)} of 4" if folds else ""
        out.append(
            f"| {rung_title(rung)} | {reading} | {' | '.join(cellular)} | {of_constant} | {of_strong} | {twice} | "
            f"{_ends(folds) if folds else ''} |"
        )
    return out


def _ends(folds) -> str:
    """Describe which numbers are at an end of their range in which folds."""
    parts = []
    for fold in folds:
        ends = [
            f"{SHORT[key.rpartition('.')[2]]} at the {end} end of its range"
            for key, end in zip(fold["keys"], fold["at_bound"])
            if end
        ]
        parts += (
            [f"fit without {fold['protocol'].split()[1]} Hz: {', '.join(ends)}"] if ends else []
        )
    return "; ".join(parts) or "none"


def _comparison_lines(rows: dict) -> list:
    """Return lines that compare earlier and present records for models that are in both."""
    out = [
        "| model | accelerometer shows | version | score at 143 Hz | score at 135, 150, 155 Hz | score with each "
        "frequency left out | starts |",
        "|---|---|---|---|---|---|---|",
    ]
    for rung, reading, *before, starts in EARLIER_LADDER:
        row = rows.get((rung, reading, "143", ""))
        if row is None:
            continue
        out += [
            f"| {rung_title(rung)} | {reading} | before | {' | '.join(before)} | {starts} |",
            f"| | | after | {three(row['fitted'])} | {three(row['others'])} | {_mark_scores(rows, rung, reading)} | "
            f"{row['valleys']['starts']} |",
        ]
    return out


def _placebos(rows: dict) -> list:
    out = [
        "| model: wrong value | scores with the true value: fitted, predicted | score with the wrong value: fitted "
        "| score with the wrong value: predicted |",
        "|---|---|---|---|",
    ]
    for rung, reading, protocol, placebo in variants():
        row = rows.get((rung, reading, protocol, placebo))
        real = rows.get((rung, reading, protocol, ""))
        if not placebo or row is None:
            continue
        kind, _, value = placebo.rpartition(".")[2].partition("=")
        kind = "frequency of the yaw mode" if kind == "frequency" else kind
        instead = f"{three(real and real['fitted'])}, {three(real and real['others'])}"
        out.append(
            f"| {rung_title(rung)}: {kind} = {value} | {instead} | {three(row['fitted'])} | "
            f"{three(row['others'])} |"
        )
    return out


def head(rows: dict) -> list:
    """Write the sentences on the records; a score is all / accelerations / displacements."""
    one = {name: rows[rung, reading, "143", ""] for name, (rung, reading) in NAMED_FITS.items()}
    left = {
        name: three(left_out(rows, *NAMED_FITS[name]))
        for name in ("spring", "path", "damped", "seen")
    }
    none = {name: (three(held), three(out)) for name, _, _, held, out, _ in nulls()}
    draws = [
        100 * one[name]["bootstrap"]["better"]["constant"]["acceleration"]
        for name in ("path", "root")
    ]
    said = [
        "A score is the root mean square of ln(computed/measured); smaller scores are better. Three scores separated "
        "by slashes are those of all readings / accelerations / displacements. For comparison: the logarithms of "
        "repeated readings of the same acceleration scatter with a standard deviation of .086. Two names say what the "
        'accelerometer is taken to show: "√2 x fundamental", or "peak x stuck", the peak times the ratio of reading '
        "to input while the block sticks.",
        "**Models that the data exclude.** Friction alone does not explain the data. The scores of a rigid "
        f"block are {three(one['rigid']['fitted'])} at 143 Hz. The scores of a patch with yaw are "
        f"{three(one['patch']['fitted'])} at 143 Hz and {three(one['patch']['others'])} at the other frequencies. A "
        "weight on a cable acts as a second spring, but the fit sets the stiffness of this spring to 0; the scores of "
        f"this model are {three(one['weight']['fitted'])} at 143 Hz.",
        "**Models fitted to 143 Hz alone.** The scores at 135, 150 and 155 Hz are "
        f"{none['constant'][0]} for a constant times the input; {none['power_input_frequency'][0]} for a power "
        f'law in input and frequency; {three(one["spring"]["others"])} for "spring and yaw" with √2 x fundamental '
        f'(three fitted parameters); {three(one["path"]["others"])} for "path of Fig. 27" with "peak x stuck" '
        f'(three fitted parameters; the path itself is not fitted); and {three(one["root"]["others"])} for "path of '
        'Fig. 27" with √2 x fundamental.',
        'Compared with a constant times the input, "spring and yaw" predicts the displacements better and the '
        'accelerations worse. "Path of Fig. 27" predicts displacements and accelerations better than the constant '
        'does. The advantage of "path of Fig. 27" in the accelerations is small: if the rows of Table 1 are '
        'resampled (bootstrap), "path '
        f'of Fig. 27" predicts the accelerations better than the constant in {draws[0]:.0f} % ("peak x stuck") and '
        f'{draws[1]:.0f} % (√2 x fundamental) of the samples. "Path of Fig. 27" predicts the displacements worse '
        'than "spring and yaw" does. At 143 Hz all scores of "path of Fig. 27" are worse than those of "spring '
        'and yaw": '
        f'{three(one["path"]["fitted"])}, compared with {three(one["spring"]["fitted"])} for "spring and yaw".',
    ]
    if "-" not in left.values():
        said.append(
            "**Each frequency left out in turn.** The scores are "
            f"{none['constant'][1]} for a constant times the input; {none['power_input_frequency'][1]} for a power "
            f'law in input and frequency; {left["spring"]} for "spring and yaw" with √2 x fundamental; and '
            f'{left["path"]} for "path of Fig. 27" with "peak x stuck". The last two models predict the '
            'displacements better than the constant and the power law do. The scores of "second path" (a spring and '
            f'a damper) with "peak x stuck" are {left["damped"]}. These scores are no better than the scores of the '
            'constant, because the fit without 143 Hz sets "yaw arm" to 0. If the accelerometer also measures the '
            "yaw mode, the scores of "
            f"this model are {left['seen']}. No model predicts the accelerations better "
            "than the power law in input and frequency, although this power law contains no mechanics."
        )
    said.append(
        "**What the data leave open.** The second path may be a spring or the flank of a groove, with or without a "
        "damper: at the other frequencies the scores of the model with grooves, lift and yaw are "
        f'{three(one["lift"]["others"])}, nearly those of "spring and yaw". The accelerometer may '
        "have shown the peaks, 1.24 times the peaks, or √2 times the fundamental."
    )
    return "\n\n".join(
        fill(text, 120, break_long_words=False, break_on_hyphens=False) for text in said
    ).split("\n")


def parts(rows: dict) -> dict:
    """Return {name of a mark in README.md: lines between the marks}."""
    return {
        "head": head(rows),
        "rungs": _rungs(rows),
        "left out": _left_out_lines(rows),
        "before": _comparison_lines(rows),
        "placebos": _placebos(rows),
    }


def main(path: Path = FOLDER / "README.md") -> str:
    """Write every table between its marks in README.md, and return the text."""
    text = (FOLDER / "README.md").read_text("utf-8")
    for name, lines in parts(read_records()).items():
        before, _, rest = text.partition(MARK.format(name) + "\n")
        text = (
            before
            + "\n".join([MARK.format(name), *lines, MARK.format("end")])
            + rest.partition(MARK.format("end"))[2]
        )
    path.write_text(text, "utf-8")
    return text


if __name__ == "__main__":
    run_study(main)
