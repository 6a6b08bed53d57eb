"""Score `patchfem compare` on traces with known truth (`trace_pairs`), with the rules of `score_pairs`.

    python tests/support/score_traces.py --first 1 --count 16 -j 2 --table scores.json

A seed gives one pair: the kinds take turns. With --all each seed gives a pair of every kind. Flanks that run out flat
(`trace_pairs.RUN_OUT`) are scored apart: the ends and widths of their tracks have the suffix `_flat`.

Seeds 1 to 60 serve for building. The score of a method counts on seeds that nobody has used before: 2001 to 2304 are
spent; for intervals that allow for a drift of the datum they are 2401 to 2704:

    python tests/support/score_traces.py --first 2401 --count 304 -j 2 --table scores.json
"""

import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
from score_pairs import (
    check_intervals,
    compare,
    find_faults,
    make_parser,
    print_quantities,
    run_scores,
    write_table,
)
from trace_pairs import HIDDEN, KINDS, RUN_OUT, UNWORN, draw_pair

PLACES = (
    "track_from",
    "track_to",
    "track_width",
    "track_depth",
    "worn_from_after",
    "worn_to_after",
)


def score_pair(request: tuple) -> dict:
    """Compare the pair (kind, seed) and score the answer."""
    kind, seed = request
    pair = draw_pair(kind, seed)
    with tempfile.TemporaryDirectory() as folder:
        try:
            answer = compare(pair, Path(folder))
        except Exception as failure:  # a crash is counted like a refusal, with its type
            answer = {"seconds": 0.0, "error": f"CRASH {type(failure).__name__}: {failure}"}
    row = {
        "kind": kind,
        "seed": seed,
        "seconds": answer["seconds"],
        "headline": answer.get("verdict", ""),
    }
    if "error" in answer:
        return row | {
            "error": answer["error"],
            "faults": [],
            "intervals": {},
            "truth": {},
            "missed": False,
        }
    intervals = check_intervals(pair, answer)
    truth = {name: answer[name]["value"] - check[2] for name, check in intervals.items()}
    suffix = "_flat" if kind in RUN_OUT else ""
    names = {name: name + suffix if name in PLACES else name for name in intervals}
    is_worn = kind not in (*UNWORN, *HIDDEN, "elsewhere", "deposits")
    return row | {
        "sentences": answer.get("sentences", []),
        "faults": find_faults(pair, kind in UNWORN, answer),
        "intervals": {names[name]: check for name, check in intervals.items()},
        "truth": {names[name]: value for name, value in truth.items()},
        "missed": is_worn and "worn" not in row["headline"].lower(),
    }


def print_row(row: dict) -> None:
    """Print one line per pair."""
    wrong = [f"{name} {check[3]:.1f}" for name, check in row["intervals"].items() if not check[0]]
    print(
        f"{row['seed']:6d} {row['kind']:15s} {row['seconds']:5.1f} s {row['headline'][:70]!r} "
        f"{row.get('error', '')[:120]} {row['faults'] or ''} {wrong or ''}",
        flush=True,
    )


def print_precision(rows: list) -> dict:
    """Print and return the counts per kind and, per quantity, the intervals that hold and their half-widths."""
    summary = {}
    for kind in dict.fromkeys(row["kind"] for row in rows):
        chosen = [row for row in rows if row["kind"] == kind]
        quantities = defaultdict(list)
        for row in chosen:
            for name, (holds, half, _, _) in row["intervals"].items():
                true = abs(row["truth"][name])
                quantities[name].append((holds, half / true if true > 0 else np.nan))
        counts = {
            name: [
                sum(bool(check[0]) for check in checks),
                len(checks),
                float(np.median([check[1] for check in checks])),
            ]
            for name, checks in quantities.items()
        }
        summary[kind] = {
            "pairs": len(chosen),
            "false": sum(bool(row["faults"]) for row in chosen),
            "refused": sum("error" in row for row in chosen),
            "missed": sum(row["missed"] for row in chosen),
            "quantities": counts,
        }
        cells = [
            f"{name} {held}/{of} ({100 * half:.2g} %)" for name, (held, of, half) in counts.items()
        ]
        entry = summary[kind]
        print(
            f"{kind:15s} {entry['pairs']} pairs, {entry['false']} false, {entry['refused']} refused, "
            f"{entry['missed']} missed; " + ", ".join(cells)
        )
    return summary


def main() -> None:
    """Score the pairs of consecutive seeds."""
    parser = make_parser(__doc__)
    parser.add_argument("--all", action="store_true", help="every kind for each seed")
    request = parser.parse_args()
    seeds = range(request.first, request.first + request.count)
    wanted = [(KINDS[(seed - 1) % len(KINDS)], seed) for seed in seeds]
    if request.all:
        wanted = [(kind, seed) for seed in seeds for kind in KINDS]
    rows = run_scores(score_pair, wanted, request, print_row)
    summary = print_precision(rows)
    print()
    print_quantities(rows)
    write_table(request.table, summary, rows)


if __name__ == "__main__":
    main()
