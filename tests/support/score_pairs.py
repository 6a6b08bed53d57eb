"""Rules and command line of the scores of `patchfem compare` on pairs with known truth.

A headline is false where it says something that is not so: wear on an unworn surface, no wear although the worn part is
deeper than the comparison claims to detect, one place for two. An interval holds where it contains the truth.
"""

import argparse
import contextlib
import io
import json
import multiprocessing
import os
import re
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

from patchfem.__main__ import main as run_command

UNITS = {"nm": 1e-9, "um": 1e-6, "mm": 1e-3, "m": 1.0}


def compare(pair, folder: Path) -> dict:
    """Return the JSON answer of `patchfem compare` for a pair; `error` holds the message where it is refused."""
    names = []
    for name, (x, z) in (("before", pair.before), ("after", pair.after)):
        path = folder / f"{name}.csv"
        np.savetxt(
            path,
            np.column_stack([x * 1e3, z * 1e6]),
            delimiter=",",
            fmt="%.7f",
            header="x [mm],z [um]",
            comments="",
        )
        names.append(str(path))
    out = io.StringIO()
    err = io.StringIO()
    code = 0
    start = time.process_time()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            run_command(["compare", *names, "--json", "-o", str(folder / "out")])
        except SystemExit as end:
            code = end.code or 0
    seconds = time.process_time() - start
    if code:
        return {"seconds": seconds, "error": (err.getvalue().strip().splitlines() or ["?"])[-1]}
    return {"seconds": seconds} | json.loads(out.getvalue())


def find_faults(pair, unworn: bool, answer: dict) -> list:
    """List what the headline or the sentences say that is false."""
    headline = answer.get("verdict", "")
    text = " ".join((headline, *answer.get("sentences", []))).lower()
    comparable = not headline.lower().startswith("not comparable")
    faults = []
    if pair.kind == "elsewhere":
        if comparable and answer.get("worn_depth_mean", {}).get("value") is not None:
            faults.append("depth for two different places")
        return faults
    says_worn = headline.lower().startswith("worn")
    if unworn and says_worn:
        faults.append("worn, but nothing wore")
    if pair.kind in ("deposits", "even", "wedge") and says_worn:
        faults.append("depth of wear shown where none can be shown")
    if unworn and any(word in headline for word in ("reduced", "increased", "flatter")):
        faults.append("waves changed, but they did not")
    true_mean = pair.worn.mean()
    true_max = pair.worn.max()
    limit = re.search(r"would have been found from a mean depth of ([\d.e+-]+) (nm|um|mm)", text)
    if (
        limit
        and pair.kind not in ("even", "wedge")
        and true_mean > float(limit[1]) * UNITS[limit[2]]
    ):
        faults.append(f"mean {true_mean:.3g} m not found, limit stated {limit[0]}")
    if (
        "no wear" in text
        and not unworn
        and true_max > 20 * 15e-9
        and pair.kind not in ("even", "wedge")
    ):
        faults.append(f"no wear, but {true_max:.3g} m at the deepest place")
    hidden = (answer.get("hidden_wear") or {}).get("high")
    if hidden is not None and pair.kind in ("even", "wedge") and hidden < true_mean:
        faults.append(f"at most {hidden:.3g} m hidden, true {true_mean:.3g} m")
    return faults


def check_intervals(pair, answer: dict) -> dict:
    """Return name -> (holds, half-width, error) for each printed quantity whose truth is known."""
    truth = {}
    x = pair.after[0]
    y = x + pair.shift
    common = (y >= 0) & (y <= pair.before[0][-1])
    # pile-up is not counted as negative wear
    worn = np.maximum(pair.worn[common], 0.0)
    spacing = x[1] - x[0]
    hides = pair.kind in ("even", "wedge", "elsewhere")
    if not hides:
        truth["shift"] = None
        truth["worn_depth_mean"], truth["worn_depth_max"] = worn.mean(), worn.max()
        truth["worn_area"] = worn.sum() * spacing
    if getattr(pair, "span", None) is not None:
        lost = np.maximum(pair.worn, 0)
        truth["track_from"], truth["track_to"] = pair.span
        truth["track_width"] = pair.span[1] - pair.span[0]
        truth["track_area_gross"] = lost.sum() * spacing
        truth["track_depth"] = truth["track_area_gross"] / truth["track_width"]
        truth["worn_from_after"], truth["worn_to_after"] = pair.span
    found = {}
    for name, true in truth.items():
        quantity = answer.get(name)
        if isinstance(quantity, dict) and quantity.get("over", "common length") != "common length":
            continue  # it is a mean over the track alone, which the entries of the track cover
        if true is None or not isinstance(quantity, dict):
            continue
        if quantity.get("low") is None or quantity.get("high") is None:
            continue
        low = quantity["low"]
        high = quantity["high"]
        outside = max(low - true, true - high, 0.0)
        half = (high - low) / 2
        found[name] = (
            outside <= 0.0,
            half,
            quantity["value"] - true,
            outside / half if half > 0 else np.inf,
        )
    return found


def print_quantities(rows: list) -> None:
    """Print for each quantity how many intervals hold, and the counts of all pairs."""
    checks = defaultdict(list)
    for row in rows:
        for name, value in row["intervals"].items():
            checks[name].append(value)
    for name, values in checks.items():
        worst = max(value[3] for value in values)
        print(
            f"{name:18s} holds {sum(v[0] for v in values)}/{len(values)} = "
            f"{np.mean([v[0] for v in values]):.3f}, median half-width {np.median([v[1] for v in values]):.3g}, "
            f"worst miss {worst:.1f} half-widths outside"
        )
    print(
        f"false {sum(bool(row['faults']) for row in rows)} of {len(rows)}; refused "
        f"{sum('error' in row for row in rows)}; CPU median {np.median([row['seconds'] for row in rows]):.2f} s"
    )


def run_scores(score, requests: list, request, print_row) -> list:
    """Score pairs in several processes and print each.

    Parameters
    ----------
    score : callable
        From an entry of `requests` to a row.
    requests : list
    request : argparse.Namespace
        Options of `parse_request`.
    print_row : callable
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # the processes share the cores
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    rows = []
    with multiprocessing.get_context("spawn").Pool(request.jobs) as pool:
        for row in pool.imap(score, requests):
            rows.append(row)
            print_row(row)
    print("\nheld/intervals (median half-width / truth) per kind")
    return rows


def make_parser(description: str) -> argparse.ArgumentParser:
    """Return the options that all scores have."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--first", type=int, required=True, help="first seed")
    parser.add_argument("--count", type=int, required=True, help="number of seeds")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="processes")
    parser.add_argument("--table", type=Path, help="JSON file of the scores")
    return parser


def write_table(path: Path | None, summary: dict, rows: list) -> None:
    """Write the summary and the rows where a file is named."""
    if path:
        table = {"summary": summary, "rows": rows}
        path.write_text(json.dumps(table, indent=1, default=float), "utf-8")
