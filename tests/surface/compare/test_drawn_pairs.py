"""Score of the comparison of traces on 250 drawn pairs of six generators (`support/worn_pairs.py`).

Recipe, fixed before anything was computed with its seed: all pairs of all generators with SEED, of which nothing was used in
development (that used seeds 7, 8 and 9). `python tests/surface/compare/test_drawn_pairs.py [SEED]` prints the score.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[2] / "support"))

from worn_pairs import GENERATORS, INTERVALS, VERDICTS, draw_pair, score_pair

SEED = 20261401  # of the held-out pairs
MAX_FALSE_FRACTION = 0.01
MAX_MISSED_FRACTION = 0.04
MIN_HOLDING_FRACTION = 0.94


def score_generator(generator: str, seed: int) -> list[dict]:
    """Return the scores of all pairs of a generator for a seed."""
    count = GENERATORS[generator].count
    return [score_pair(draw_pair(generator, seed, index)) for index in range(count)]


def format_scores(name: str, rows: list[dict]) -> str:
    """Return the counts of verdicts and of intervals that hold, with median half-widths and errors in percent."""
    parts = [f"{word} {sum(row['verdict'] == word for row in rows)}" for word in VERDICTS]
    for key in INTERVALS:
        held = [row[key] for row in rows if row.get(key) is not None]
        widths = [100 * row[f"{key} width"] for row in rows if f"{key} width" in row]
        if held and widths:
            parts.append(f"{key} {sum(held)}/{len(held)} ({np.median(widths):.2g} %)")
    return f"{name} {len(rows)}: {', '.join(parts)}"


@pytest.mark.slow
def test_always_few_drawn_pairs_are_misjudged():
    """Of 250 held-out pairs at most 1 % have a false verdict and 4 % a missing one; 94 % of the intervals hold."""
    rows = [row for generator in GENERATORS for row in score_generator(generator, SEED)]
    verdicts = [row["verdict"] for row in rows]
    assert verdicts.count("false") <= MAX_FALSE_FRACTION * len(rows)
    assert verdicts.count("missed") <= MAX_MISSED_FRACTION * len(rows)
    for key in INTERVALS:
        held = [row[key] for row in rows if row.get(key) is not None]
        assert np.mean(held) >= MIN_HOLDING_FRACTION, key


if __name__ == "__main__":
    every = []
    for each in GENERATORS:
        scored = score_generator(each, int(sys.argv[1]) if len(sys.argv) > 1 else SEED)
        every += scored
        print(format_scores(each, scored), flush=True)
        for number, row in enumerate(scored):
            faults = [key for key in INTERVALS if row.get(key) is False]
            if faults or row["verdict"] != "right":
                print("  ", number, row["kind"], row["code"], row["verdict"], *faults, flush=True)
    print(format_scores("all", every))
