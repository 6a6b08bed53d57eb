"""Marches of bonds behind shear modes that keep only extremes and sums of past cycles, against
marches that keep all samples."""

from dataclasses import replace

import numpy as np
import pytest
from march_paths import OMEGA
from modal_bases import make_modal_basis
from test_march_repeats import BASIS, compliant_points_model

from patchfem.core import SineDrive
from patchfem.dynamics.march.march import march

TWO = make_modal_basis(OMEGA * np.array([1.0, 0.9]), 0.05, [1.0, 0.2], np.ones(2), [1.0, -0.5])
COUPLED = replace(TWO, damping=OMEGA * np.array([[0.1, 0.02], [0.02, 0.09]]))
LEDGER_NAMES = (
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


def assert_close(found, expected, rel: float = 1e-12):
    """Assert that two arrays agree within a relative tolerance of the largest value."""
    np.testing.assert_allclose(found, expected, rtol=rel, atol=rel * np.abs(expected).max())


def march_both_ways(basis, acceleration: float, cycles: float, steps: int = 80, **options) -> tuple:
    """Return a march that keeps its samples, and one that keeps only extremes and sums."""
    drive = SineDrive(acceleration, OMEGA)
    model = compliant_points_model()
    return march(basis, drive, model, cycles, steps, 5, **options), march(
        basis, drive, model, cycles, steps, 5, keeps_samples=False, keeps_extremes=True, **options
    )


@pytest.mark.parametrize("basis", [BASIS, COUPLED], ids=["one mode", "coupled by damping"])
@pytest.mark.parametrize(
    "acceleration, cycles",
    [(49.0, 40.25), (300.0, 37)],
    ids=["slips", "drags"],
)
def test_exact_condensed_cycles_agree_with_complete_samples(basis, acceleration, cycles):
    """Extremes, phasors, last cycles and energies agree within 1e-12 with a march that keeps its
    samples."""
    complete, condensed = march_both_ways(basis, acceleration, cycles)
    assert_close(condensed.extremes, complete.extremes)
    assert_close(condensed.phasors, complete.phasors)
    for name in ("slide", "slide_rate", "force", "slip"):
        assert_close(getattr(condensed.window, name), getattr(complete.window, name))
    assert {name: condensed.ledger[name] for name in LEDGER_NAMES} == pytest.approx(
        {name: complete.ledger[name] for name in LEDGER_NAMES}, rel=1e-12
    )
    assert condensed.ledger["iterations"] == complete.ledger["iterations"]
    ends = condensed.response.extra["ledger"][:, -1], complete.response.extra["ledger"][:, -1]
    assert ends[0] == pytest.approx(ends[1], rel=1e-12, abs=1e-15 * complete.ledger["work_in"])


def test_exact_sample_of_largest_slide_is_kept():
    """The sample of the largest slide before the last cycles is kept and agrees with that of a
    complete march."""
    _, condensed = march_both_ways(TWO, 49.0, 37)
    complete = march(TWO, SineDrive(49.0, OMEGA), compliant_points_model(), 37, 80, 37)
    first = condensed.response
    index = np.argmin(np.abs(complete.window.time - first.time[0]))
    assert index == np.argmax(np.abs(complete.window.slide[: 32 * 80 + 1]))
    for name in ("slide", "slide_rate", "force", "slip", "output"):
        assert getattr(first, name)[0] == pytest.approx(
            getattr(complete.window, name)[index], rel=1e-12
        ), name
    assert first.extra["ledger"][:, 0] == pytest.approx(
        complete.window.extra["ledger"][:, index], rel=1e-11, abs=1e-15
    )
    assert len(first.time) == 5 * 80 + 2


def test_exact_run_that_exceeds_travel_agrees_with_complete_march():
    """A run that exceeds its travel ends at the same cycle and with the same motion as a march that
    keeps its samples."""
    complete, condensed = march_both_ways(BASIS, 300.0, 37, travel=2e-4)
    assert (
        condensed.outcome is complete.outcome is not None
        and condensed.cycles_done == complete.cycles_done < 32
    )
    assert_close(condensed.extremes, complete.extremes)
    assert_close(condensed.response.slide, complete.response.slide)
