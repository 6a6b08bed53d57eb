"""Errors of lumped sweeps that are marched together, against an independent program, on seeds that served nothing else."""

import numpy as np
import pytest
from campaigns import Row
from sweep_references import LAWS, compute_references, draw_sweep

from patchfem.runs.batch import batches, lumped

# Laws and seeds of eight sweeps of 48 cases.
SWEEPS = [*((law, 20261203) for law in LAWS), ("elastic-plastic", 20261204)]
MIN_RESOLVED = 2.0  # doubts of the reference that a true error must exceed to be compared with the stated error


def compare_sweep(law: str, seed: int) -> list[Row]:
    """Return a row for each measure of the cases of a sweep that were marched together."""
    sweep = draw_sweep(law, seed)
    results = batches.solve_models(sweep.models)
    rows = []
    for case, numbers in enumerate(sweep.numbers):
        if results.numerics[case]["engine"] != lumped.BATCH_ENGINE:
            continue
        truths, doubts = compute_references(numbers)
        for name, truth in truths.items():
            columns = (getattr(results, kind).get(name) for kind in ("values", "errors", "floors"))
            value, error, floor = (np.nan if column is None else column[case] for column in columns)
            # the reference of a stiff case may not converge
            if np.isfinite([value, error, truth, doubts[name]]).all():
                rows.append(Row(name, value, error, floor, truth, doubts[name]))
    return rows


@pytest.mark.slow
def test_always_errors_of_eight_sweeps_hold_and_are_sharp():
    """97 % of the errors hold, and their median is at most 6 times the true error."""
    ratios, all_rows = [], []
    for law, seed in SWEEPS:
        rows = compare_sweep(law, seed)
        own = [
            row.error / row.true_error
            for row in rows
            if row.true_error > max(MIN_RESOLVED * row.doubt, 1e-9 * abs(row.value))
        ]
        holds = np.mean([row.holds for row in rows])
        print(
            f"{law} {seed}: {len(rows)} errors, {holds:.4f} hold, {len(own)} resolved, median {np.median(own):.2f}"
        )
        ratios += own
        all_rows += rows
    print(f"median {np.median(ratios):.2f} of {len(ratios)}")
    assert np.mean([row.holds for row in all_rows]) >= 0.97
    assert np.median(ratios) <= 6
