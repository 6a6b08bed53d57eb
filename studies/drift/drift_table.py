"""How far does a block creep under a biased dither that never reaches its friction limit? Bond lengths per cycle.

The force is held at .5 +- .1, .5 +- .3 and .3 +- .3 of mu_s N, the load at N +- 10 % and +- 20 %, quasi-statically at
the pace of 143 Hz; README.md beside this file has every law and case. At .5 +- .1 the constant stretch p = 1, which is
Dahl's law, creeps by .272 bond lengths per cycle for ever, tanh with v_0 = 1 mm/s by 1.93 and Bouc-Wen (n = 2) by
.0695. Coulomb, elastic-plastic and Iwan close every loop and do not creep. The law as printed locks up: .098, .030,
.006, .0014 after 2, 3, 6, 12 cycles for p = 1, with energy out of nothing.

Run: python studies/drift/drift_table.py [--growing]      (with bonds that grow)
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drift_laws import (
    CASES,
    LENGTH,
    PERIOD,
    Row,
    closed_form_rows,
    engines,
    laws_without_bonds,
)
from force_control import OutOfReach, slides
from study_run import Option, run_study

CYCLES = 12


def row(name: str, engine, case: str, cycles: int = CYCLES) -> Row:
    """Return the row of a law under the force of a case, by time steps."""
    forces, loads = CASES[case]
    pieces = 4 if len(set(forces)) > 1 and len(set(loads)) > 1 else 1
    try:
        ends = slides(engine, forces, loads, cycles, pieces, PERIOD, LENGTH) / LENGTH
    except OutOfReach:
        return Row(name, case, None, None)
    return Row(name, case, float(ends[1] - ends[0]), float(ends[-1] - ends[-2]))


def is_supported(name: str, case: str) -> bool:
    """Return whether runs support a law in a case: stretch laws of another order than 1 have a constant load."""
    is_constant = len(set(CASES[case][1])) == 1
    return is_constant or not name.startswith("stretch") or "p = 1" in name


def main(laws=None, cases=tuple(CASES), growing: bool = True) -> dict:
    """Print a Markdown table of all laws and cases, and return {(law, case): Row}.

    `laws` is {name: law}, by default all of them.
    """
    if laws is None:
        laws = laws_without_bonds() | engines(False) | (engines(True) if growing else {})
    out = {(found.law, case): found for case in cases for found in closed_form_rows(case)}
    for name, engine in laws.items():
        out |= {(name, case): row(name, engine, case) for case in cases if is_supported(name, case)}
    print(
        "| drift per cycle [bond lengths]: last (second) | "
        + " | ".join(cases)
        + " |\n"
        + "|---" * (len(cases) + 1)
        + "|"
    )
    for name in dict.fromkeys(name for name, _ in out):
        cells = (out.get((name, case)) for case in cases)
        print(f"| {name} | " + " | ".join(_cell(cell) for cell in cells) + " |", flush=True)
    return out


def _cell(found) -> str:
    if found is None:
        return ""
    if found.last is None:
        return "away"
    last, second = (0.0 if abs(v) < 1e-9 else v for v in (found.last, found.second))
    return f"{last:.4g}" if abs(last - second) < 1e-6 else f"{last:.4g} ({second:.3g})"


if __name__ == "__main__":
    run_study(main, growing=Option(False, "with bonds that grow"))
