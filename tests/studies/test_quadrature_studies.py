"""The sentences of the quadrature studies: error bounds always on a short path, speed targets when asked for."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from patchfem.friction.bonds.engines import MERGE_ERROR_GROWING


def study(name: str):
    """A study page as a module."""
    path = Path(__file__).parents[2] / "studies" / "quadrature" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def check(rows):
    assert {row.engine for row in rows} >= {"truncated", "merged"}
    for row in rows:
        if row.engine == "truncated":
            assert row.error <= row.value
        if row.engine == "merged":
            assert row.error <= MERGE_ERROR_GROWING * row.value**2 + 1e-6
            assert row.strips <= 8 / row.value + 300


def test_exact_errors_stay_below_their_bounds(tmp_path):
    page = study("error_cost")
    rows = page.main((3.0,), 1)
    check(rows)
    steps = [row.error for row in rows if row.engine == "steps"]
    best = min(row.error for row in rows if row.engine == "merged")
    assert steps[-1] > 100 * best  # the steps of the path cost accuracy, not the sum
    assert (
        "truncated" in page.table(rows)
        and page.draw(rows, tmp_path / "picture.svg").stat().st_size > 1e3
    )


@pytest.mark.slow
def test_exact_errors_stay_below_their_bounds_at_every_amplitude():
    check(study("error_cost").main())
