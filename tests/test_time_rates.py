"""The table of computing times, by which plans estimate their duration and machines are compared."""

from __future__ import annotations

import pytest
from scene_texts import BENCH

from patchfem import cost_model, plan
from patchfem.scene import loads


def test_exact_half_speed_gives_time_ratio_two(monkeypatch):
    """A machine that takes twice the reference seconds has a time ratio of 2."""
    ticks = iter(range(0, 1000))
    monkeypatch.setattr(
        cost_model, "process_time", lambda: cost_model.REFERENCE_WORK_SECONDS * 2 * next(ticks)
    )
    assert cost_model.measure_machine_time_ratio() == pytest.approx(2.0, rel=1e-12)


def test_always_plan_includes_start_seconds():
    """The estimated time of a bench contains the start of the process and at most 3 s more."""
    seconds = plan(loads(BENCH, "a.toml")).seconds
    assert cost_model.START_SECONDS <= seconds < cost_model.START_SECONDS + 3.0
