"""Cycles of bonds behind shear modes that are folded as they pass, against a march that keeps every sample."""

from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from march_paths import OMEGA
from test_lanes import TWO, near
from test_march_repeats import BASIS, sheared

from patchfem.core import SineDrive
from patchfem.dynamics.march.march import march

COUPLED = replace(TWO, damping=OMEGA * np.array([[0.1, 0.02], [0.02, 0.09]]))
BOOKS = (
    "work_in",
    "viscous",
    "power",
    "friction",
    "peak_stored",
    "stored",
    "booked",
    "sampled",
    "passed",
)


def both(basis, push: float, cycles: float, steps: int = 80, **more) -> tuple:
    """A march that keeps every sample worth it, and one that folds."""
    drive = SineDrive(push, OMEGA)
    model = sheared()
    return march(basis, drive, model, cycles, steps, 5, **more), march(
        basis, drive, model, cycles, steps, 5, keeps_samples=False, keeps_extremes=True, **more
    )


@pytest.mark.parametrize(
    "basis", [BASIS, TWO, COUPLED], ids=["one mode", "two modes", "coupled by damping"]
)
@pytest.mark.parametrize(
    "push, cycles", [(5.0, 37), (49.0, 40.25), (300.0, 37)], ids=["sticks", "slips", "drags"]
)
def test_exact_folded_cycles_are_those_of_a_march_that_keeps_them(basis, push, cycles):
    whole, folded = both(basis, push, cycles)
    near(folded.amplitudes, whole.amplitudes)
    near(folded.phasors, whole.phasors)
    for name in ("slide", "slide_rate", "force", "slip"):
        near(getattr(folded.window, name), getattr(whole.window, name))
    assert {name: folded.ledger[name] for name in BOOKS} == pytest.approx(
        {name: whole.ledger[name] for name in BOOKS}, rel=1e-12
    )
    assert folded.ledger["iterations"] == whole.ledger["iterations"]
    ends = folded.response.extra["ledger"][:, -1], whole.response.extra["ledger"][:, -1]
    assert ends[0] == pytest.approx(ends[1], rel=1e-12, abs=1e-15 * whole.ledger["work_in"])


def test_exact_the_sample_of_the_largest_slide_is_kept():
    """It is a sample of the march before the last cycles, as one that keeps every sample of them has it."""
    _, folded = both(TWO, 49.0, 37)
    every = march(TWO, SineDrive(49.0, OMEGA), sheared(), 37, 80, 37)
    first = folded.response
    at = np.argmin(np.abs(every.window.time - first.time[0]))
    assert at == np.argmax(np.abs(every.window.slide[: 32 * 80 + 1]))
    for name in ("slide", "slide_rate", "force", "slip", "output"):
        assert getattr(first, name)[0] == pytest.approx(
            getattr(every.window, name)[at], rel=1e-12
        ), name
    assert first.extra["ledger"][:, 0] == pytest.approx(
        every.window.extra["ledger"][:, at], rel=1e-11, abs=1e-15
    )
    assert len(first.time) == 5 * 80 + 2


def test_exact_a_run_that_ends_on_the_way_is_marched_cycle_by_cycle():
    whole, folded = both(BASIS, 300.0, 37, travel=2e-4)
    assert (
        folded.outcome is whole.outcome is not None and folded.cycles_done == whole.cycles_done < 32
    )
    near(folded.amplitudes, whole.amplitudes)
    near(folded.response.slide, whole.response.slide)


def test_exact_a_motion_that_repeats_leaves_the_rest_of_its_cycles_out():
    whole, folded = both(BASIS, 49.0, 600)
    assert folded.amplitudes.shape == (600, 2) and folded.phasors.shape == (600,)
    near(folded.amplitudes, whole.amplitudes, 1e-10)
    assert folded.ledger["work_in"] == pytest.approx(whole.ledger["work_in"], rel=1e-10)
    seconds = {}
    for cycles in (600, 600_000):
        begin = process_time()
        march(
            BASIS,
            SineDrive(49.0, OMEGA),
            sheared(),
            cycles,
            80,
            5,
            keeps_samples=False,
            keeps_extremes=True,
        )
        seconds[cycles] = process_time() - begin
    # a thousand times as many cycles; 3 was seen, and a march of all cycles takes above 1000
    assert seconds[600_000] < 50 * seconds[600]
