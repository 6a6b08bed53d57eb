"""Score of the comparison on pairs of areal scans with known wear, from two generators.

    python tests/support/scan_scores.py SEED COUNT [MODULE.py]

`scan_pairs` belongs to the tests; MODULE.py is that of somebody who had not seen the method: `make(seed)` returns
`before`, `after` (x, y, z) and `truth`. A verdict is false if it states wear or growth where there is none, or no wear
where the worn volume divided by the noise of its region is beyond doubt. It is missed if there is wear between unworn
places and none is stated. The interval of the worn volume must contain the lost volume.
"""

import sys
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import scan_pairs
from trace_scores import load_function

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface.areal import Areal

CHANGED = ("worn", "worn_and_grown", "grown")


class ScoredScans(NamedTuple):
    """Two scans, and what is true of them.

    - is_worn, has_grown: as for traces, None if it cannot be decided.
    - volume, largest: lost volume [m3] and largest depth [m].
    - may_refuse: whether "no common place" is right too.
    """

    name: str
    before: Areal
    after: Areal
    is_worn: bool | None
    has_grown: bool
    volume: float
    largest: float
    may_refuse: bool = False


def _make_scan(x, y, z, name: str) -> Areal:
    return Areal(*(frozen_array(np.asarray(values, float)) for values in (x, y, z)), name)


def draw_known(seed: int, count: int) -> Iterator[ScoredScans]:
    """Draw pairs of `scan_pairs`, all kinds in turn."""
    for k in range(count):
        kind = scan_pairs.KINDS[k % len(scan_pairs.KINDS)]
        pair = scan_pairs.draw_pair(seed + k, kind)
        scans = []
        for name, z in (("before", pair.before), ("after", pair.after)):
            rows, columns = z.shape
            axes = (pair.spacing * np.arange(columns), pair.spacing * np.arange(rows))
            scans.append(_make_scan(*axes, z, name))
        truth = pair.truth
        is_worn = "no wear" in truth.sentence and "worn" not in truth.sentence
        if kind in scan_pairs.UNKNOWABLE:
            is_worn = None
        elif kind not in ("remounted", "deposits", "exchanged"):
            is_worn = True
        yield ScoredScans(
            kind,
            *scans,
            is_worn=is_worn,
            has_grown=truth.volumes.grown > 0.02 * truth.volumes.worn or kind == "exchanged",
            volume=truth.volumes.worn,
            largest=truth.depths.maximum,
            may_refuse=kind in (*scan_pairs.UNKNOWABLE, "exchanged"),
        )


def draw_other(path: str, seed: int, count: int) -> Iterator[ScoredScans]:
    """Draw pairs of the generator of somebody else."""
    make = load_function(f"{path}:make")
    for k in range(count):
        pair = make(seed + k)
        truth = pair["truth"]
        yield ScoredScans(
            truth["kind"],
            _make_scan(*pair["before"], "before"),
            _make_scan(*pair["after"], "after"),
            is_worn=bool(truth["worn"]),
            has_grown=truth["built_up_volume"] > 0.02 * truth["removed_volume"],
            volume=truth["removed_volume"],
            largest=truth["largest_depth"],
        )


def judge(before: Areal, after: Areal) -> tuple[str, tuple | None, tuple | None]:
    """Return the verdict, and the intervals of the volume [m3] and of the largest depth [m]."""
    from patchfem.surface.compare.compare import compare_surfaces

    try:
        comparison = compare_surfaces(before, after)
    except PatchfemError:
        return "refused", None, None
    values = comparison.values
    bounds = [values[name][:3] for name in ("worn_volume", "worn_depth_max")]
    return comparison.verdict.code, *(each if each[0] is not None else None for each in bounds)


def score_pair(pair: ScoredScans, judge: Callable = judge) -> dict:
    """Compare a pair, and return its verdict and which intervals hold."""
    start = time.process_time()
    code, volume, largest = judge(pair.before, pair.after)
    row = {"name": pair.name, "code": code, "seconds": time.process_time() - start}
    says_worn = code.startswith("worn")
    row["false"] = (says_worn and pair.is_worn is False) or (
        code == "grown" and not pair.has_grown and pair.is_worn is not None
    )
    refused = code in ("elsewhere", "refused") and pair.is_worn is not None
    row["refused"] = refused and not pair.may_refuse
    row["missed"] = bool(pair.is_worn and not says_worn)
    if says_worn and pair.is_worn is not False:
        for name, bounds, true in (
            ("volume", volume, pair.volume),
            ("largest", largest, pair.largest),
        ):
            if bounds is None or true is None:
                continue
            upper = np.inf if bounds[2] is None else bounds[2]
            row[name] = bool(bounds[1] <= true <= upper)
            row[f"{name}_interval"] = (*bounds, true)
    return row


def format_scores(name: str, rows: list[dict]) -> str:
    """Return the counts as a line of text."""
    counts = [
        f"{key} {sum(row.get(key, False) for row in rows)}"
        for key in ("false", "refused", "missed")
    ]
    for quantity in ("volume", "largest"):
        held = [row[quantity] for row in rows if row.get(quantity) is not None]
        counts.append(f"{quantity} {sum(held)}/{len(held)}")
    return (
        f"{name:>8} {len(rows):4} pairs: "
        + ", ".join(counts)
        + f", {np.mean([row['seconds'] for row in rows]):.2f} s"
    )


def score_all(seed: int, count: int, others: list[str], judge: Callable = judge) -> list[dict]:
    """Print the scores of each generator and each pair with a fault; return the rows."""
    every = []
    generators = {"known": draw_known(seed, count)}
    generators |= {f"other{k}": draw_other(path, seed, count) for k, path in enumerate(others)}
    for name, pairs in generators.items():
        rows = [score_pair(pair, judge) for pair in pairs]
        every += rows
        print(format_scores(name, rows), flush=True)
        for row in rows:
            faults = [quantity for quantity in ("volume", "largest") if row.get(quantity) is False]
            words = [key for key in ("false", "refused", "missed") if row.get(key)]
            if faults or words:
                print(f"   {row['name']} | {row['code']} | {' '.join(words)}")
            for fault in faults:
                value, low, high, true = row[f"{fault}_interval"]
                print(
                    f"      {fault} {value:.5g} ({low:.5g}..{high or np.inf:.5g}), true {true:.5g}"
                )
    print(format_scores("all", every))
    return every


if __name__ == "__main__":
    score_all(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])
