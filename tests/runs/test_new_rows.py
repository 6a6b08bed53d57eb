"""A measure that is one new row: its bar holds what its samples leave open, behind an engine that is exact too."""

import numpy as np
import pytest
from scene_texts import MODE, PLASTIC, POINT

from patchfem.api import run
from patchfem.core import Row
from patchfem.response import rows
from patchfem.response.loops import time_mean

SCENE = POINT + PLASTIC.replace("1 um", "{length} um") + MODE + """\
[drive]
kind = "base"
frequency = "{frequency} Hz"
acceleration = "6 g"
cycles = {cycles}
"""
MEAN = Row("slide_mean", "m", 1e-10, "mean slide of the interface over the last cycles",
           lambda s: float(np.mean(s.window.slide)) if s.load is not None else None, group="friction")


@pytest.mark.parametrize("length,frequency,cycles", [(1, 140, 60), (1, 140, 7.3), (50, 140, 60), (1, 70, 60)])
def test_exact_a_new_row_has_a_bar_that_holds(monkeypatch, length, frequency, cycles):
    """The mean of samples that stand closer at events is not that over the time, which a cubic through them gives."""
    monkeypatch.setattr(rows, "ROWS", (*rows.ROWS, MEAN))
    monkeypatch.setitem(rows.TABLE, MEAN.name, MEAN)
    done = run(SCENE.format(length=length, frequency=frequency, cycles=cycles))
    found, w = done.measures["slide_mean"], done.window
    off = abs(found.value - time_mean(w.time, w.slide, w.slide_rate, w.time[0], w.time[-1]))
    assert done.extra["engine"] == "piecewise" and 1e-9 * abs(found.value) < off < found.error < 3 * off
    assert done.measures["secant_stiffness"].error == pytest.approx(1e-9 * done.measures["secant_stiffness"].value)
