"""The table of what work takes: a plan counts by it, and a machine is held against it."""

from __future__ import annotations

import pytest
from scene_texts import BENCH

from patchfem import cost_model, plan
from patchfem.scene import loads


def test_exact_a_machine_of_half_the_pace_takes_twice_as_long(monkeypatch):
    ticks = iter(range(0, 1000))
    monkeypatch.setattr(
        cost_model, "process_time", lambda: cost_model.REFERENCE_WORK_SECONDS * 2 * next(ticks)
    )
    assert cost_model.measure_machine_time_ratio() == pytest.approx(2.0, rel=1e-12)


def test_always_a_plan_counts_by_the_table():
    """The start of the process, and more."""
    seconds = plan(loads(BENCH, "a.toml")).seconds
    assert cost_model.START_SECONDS <= seconds < cost_model.START_SECONDS + 3.0
