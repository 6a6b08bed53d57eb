"""The study of a measured damper loop: the figures of its docstring, from the measured file."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "studies/damper"))
import damper

FOLDER = os.environ.get("PATCHFEM_DATA")
FILE = Path(FOLDER or ".") / "friction-damper-1hz.csv"


def test_exact_plateau_begins_half_a_stroke_after_reversal():
    """The plateau of the loop begins half a stroke after each reversal."""
    rel_disp = np.array([0.0, 1, 2, 1, 0, 1, 2])
    assert damper.plateau(rel_disp).tolist() == [False, True, True, True, True, True, True]
    rel_disp = np.array([0.0, 0.5, 2, 1.5, 0.5, 0, 0.5, 1.5])
    assert damper.plateau(rel_disp).tolist() == [False, False, True, False, True, True, False, True]


@pytest.mark.slow
@pytest.mark.skipif(
    not FILE.exists(), reason="PATCHFEM_DATA names no folder with friction-damper-1hz.csv"
)
def test_bond_law_fits_the_plateaus_but_not_the_backlash():
    """The bond law fits the work and the plateaus of the loop.

    No law fits the backlash of the joint.
    """
    rows = {row.law: row for row in damper.main(FILE, ("coulomb", "elastic-plastic", "stretch"))}
    stretch = rows["stretch"]
    loop = rows["stretch"].loop
    scatter = damper.repeat(loop)[1]
    assert stretch.fitted.fit.values[1] == pytest.approx(2.04e-3, rel=0.01)
    assert stretch.work == pytest.approx(stretch.measured, rel=0.005)
    assert stretch.plateau < 0.07 * 4.2e3
    assert stretch.rms > 8 * scatter and rows["elastic-plastic"].rms > stretch.rms
    assert rows["coulomb"].work < 0.9 * stretch.measured
    limit = stretch.fitted.fit.values[0] * damper.LOAD
    assert np.abs(loop.reading).max() > 2 * limit
    assert 40 < stretch.fitted.fit.intervals.rows < 90
