"""The tables of the ladder as markdown: every rung under every reading, models without mechanics, placebos.

A score is the root mean square of ln(computed/measured): of all readings / of accelerations / of displacements.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from fitting import training
from rungs import EACH, RUNGS, TABLE, variants

from patchfem.campaigns.rows.cells import cells_of, scores
from patchfem.campaigns.rows.nulls import NULLS, predicted

UNITS = {"static": "", "stiffness": "MN/m", "damping": "kN s/m", "slide": "", "accelerometer": "", "load": "N",
         "amplitude": "um", "acceleration_gain": ""}
SIZES = {"stiffness": 1e-6, "damping": 1e-3, "amplitude": 1e6}
SHORT = {"static": "μ", "stiffness": "k", "damping": "c", "slide": "yaw", "accelerometer": "seen", "load": "N",
         "amplitude": "A", "acceleration_gain": "gain"}


def three(found: dict | None) -> str:
    """"all / acceleration / displacement" of scores; a dash where one is missing."""
    if found is None:
        return "-"
    return " / ".join("-" if found[name] is None else f"{found[name]:.3f}".lstrip("0")
                      for name in ("all", "acceleration", "displacement"))


def left_out(rows: dict, rung: str, reading: str) -> dict | None:
    """Scores of every reading by the fit that did not see its frequency; None where a fold is missing."""
    cells, folds = cells_of(TABLE), [rows.get((rung, reading, protocol, "")) for protocol in EACH[1:]]
    if None in folds:
        return None
    logs = np.full(cells.row.size, np.nan)
    for fold in folds:
        out = ~training(cells, fold["protocol"])
        logs[out] = np.array(fold["logs"], float)[out]
    return scores(cells, logs, np.ones(logs.size, bool))


def numbers(row: dict) -> str:
    """The fitted numbers of a record, named."""
    parts = []
    for key, value in zip(row["keys"], row["values"]):
        name = key.rpartition(".")[2]
        parts.append(f"{SHORT[name]} {value * SIZES.get(name, 1):.3g} {UNITS[name]}".strip())
    return ", ".join(parts)


def nulls() -> list:
    """Rows (name, numbers of the accelerations, fitted to 143 Hz, held out, left out, all) of scores."""
    cells, out = cells_of(TABLE), []
    seen, every = training(cells, "143"), np.ones(cells.row.size, bool)
    for name in NULLS:
        logs, left = predicted(cells, name, seen)[0], np.full(cells.row.size, np.nan)
        for protocol in EACH[1:]:
            fold = training(cells, protocol)
            left[~fold] = predicted(cells, name, fold)[0][~fold]
        whole, found = predicted(cells, name, every)
        out.append((name, found["acceleration"], scores(cells, logs, seen), scores(cells, logs, ~seen),
                    scores(cells, left, every), scores(cells, whole, every)))
    return out


def tables(rows: dict) -> list:
    """Lines of markdown of what was computed: (rung, reading, protocol, placebo) -> record."""
    out = ["| model | reading | numbers | at 143 Hz | 135, 150, 155 Hz | left out | all rows | seconds |",
           "|---|---|---|---|---|---|---|---|"]
    for name, factor, fitted, held, left, whole in nulls():
        said = {"constant": "constant x input", "power_input": "power of input",
                "power_input_frequency": f"input^{factor['input']:.2f} frequency^{factor['frequency']:.2f}"}[name]
        out.append(f"| none: {said} | | | {three(fitted)} | {three(held)} | {three(left)} | {three(whole)} | |")
    for rung, one in RUNGS.items():
        for reading in one.readings:
            row = rows.get((rung, reading, "143", ""))
            if row is None:
                out.append(f"| {rung} | {reading} | not run | | | | | |")
                continue
            every = rows.get((rung, reading, "all", ""))
            out.append(f"| {rung} | {reading} | {len(row['values'])}: {numbers(row)} | {three(row['fitted'])} | "
                       f"{three(row['others'])} | {three(left_out(rows, rung, reading))} | "
                       f"{three(every and every['fitted'])} | {row['seconds']:.0f} |")
    for key in AFTERWARDS:
        if row := rows.get(key):
            out.append(f"| afterwards: {key[0]}, {key[2].split(', ')[1]} | {key[1]} | {len(row['values'])}: "
                       f"{numbers(row)} | {three(row['fitted'])} | {three(row['others'])} | - | - | "
                       f"{row['seconds']:.0f} |")
    tried = [key for key in variants() if key[3] and key in rows]
    if tried:
        out += ["", "| placebo | in the place of | fitted | predicted |", "|---|---|---|---|"]
    for rung, reading, protocol, placebo in tried:
        row, real = rows[rung, reading, protocol, placebo], rows.get((rung, reading, protocol, ""))
        instead = f"{three(real and real['fitted'])}, {three(real and real['others'])}"
        out.append(f"| {rung}: {placebo.rpartition('.')[2].replace('=', ' ')} | {instead} | {three(row['fitted'])} | "
                   f"{three(row['others'])} |")
    return out
