"""The ladder of Table 1: its recipe can be asked, and what is left out of a fit is not seen by it."""

import numpy as np
import pytest
from study_module import study

from patchfem.campaigns.rows.cells import cells_of
from patchfem.campaigns.rows.computed import Computed
from patchfem.core import NotConverged


@pytest.fixture(scope="module")
def fitting():
    return study("table_1/fitting.py")


def test_always_every_rung_can_be_asked_under_every_reading(fitting):
    """20 conditions each; the numbers of its scene lie between the ends that are searched, what is 0 there apart."""
    cells = cells_of(fitting.TABLE)
    for rung in fitting.RUNGS.values():
        for reading in rung.readings:
            asked = rung.question(reading).asked(cells.conditions)
            assert len(asked.rigs) == 20 and asked.read.reading == ("fundamental" if "fund" in reading else "peak")
            assert all(one.low < one.high for one in asked.wanted)


def test_always_the_grooves_of_a_placebo_bend_as_those_of_the_report(fitting):
    ends = [fitting.RUNGS["grooves"].question("peak", *sets).wanted[1] for sets in
            ((), ("normal.grooves.wavelength=40 um",))]
    assert (ends[1].low, ends[1].high) == pytest.approx((ends[0].low / 4, ends[0].high / 4))


def test_exact_what_a_protocol_fits_and_what_it_predicts(fitting):
    """Table 1 counted by hand: 27 accelerations and 8 displacements, 13 readings at 143 Hz, 12 at 135, 5 at 150 and
    155 Hz each; those left out in turn are all of them, once."""
    cells = cells_of(fitting.TABLE)
    assert int(cells.felt.sum()) == 27 and cells.row.size == 35
    assert int(fitting.training(cells, "143").sum()) == 13 and fitting.training(cells, "all").all()
    left = [~fitting.training(cells, f"without {one}") for one in (135, 143, 150, 155)]
    assert [int(one.sum()) for one in left] == [12, 13, 5, 5] and (np.sum(left, axis=0) == 1).all()


def test_always_a_motion_found_by_harmonics_is_no_start_for_the_map_of_yields(fitting, monkeypatch):
    """Where the map finds no motion, the balance answers, and the next numbers nearby are asked as from rest."""
    from patchfem.dynamics.piecewise import steady

    whole, asked = steady.steady, fitting.RUNGS["second path"].question("peak").asked([(143.0, 49.03)])
    values = np.array([0.4, 3.5e6, 1400.0, 0.09])

    def lost(*given):
        monkeypatch.setattr(steady, "steady", whole)
        raise NotConverged("lost")

    computed = Computed(asked)
    monkeypatch.setattr(steady, "steady", lost)
    by_balance, after = np.array(computed(values, [0])), np.array(computed(values * 1.0001, [0]))
    assert by_balance == pytest.approx(np.array(Computed(asked)(values, [0])), rel=0.02)
    assert after == pytest.approx(np.array(Computed(asked)(values * 1.0001, [0])), rel=1e-9)


@pytest.mark.slow
def test_always_a_fit_sees_nothing_but_its_training_readings(fitting):
    """One start of the second path at 143 Hz: the record is whole, and its scores are those of its own logarithms."""
    found = fitting.fitted("second path", "peak", "143", starts=1)
    assert found["keys"][0] == "friction.static" and len(found["values"]) == 4 and len(found["cells"][0]) == 20
    logs, seen = np.array(found["logs"]), fitting.training(cells_of(fitting.TABLE), "143")
    assert found["fitted"]["all"] == pytest.approx(np.sqrt(np.mean(logs[seen]**2)), rel=1e-3)
    assert found["others"]["all"] == pytest.approx(np.sqrt(np.mean(logs[~seen]**2)), rel=1e-3)
