"""Cases of sweeps that stick but still vibrate freely, and cases with large errors."""

from dataclasses import replace

import numpy as np
from scene_texts import ELASTIC_JOINT
from sweep_tables import make_table

import patchfem as pf
from patchfem.campaigns.sweeps.changes import analyse
from patchfem.export.sweeps.words import make_verdict

DRIVE = '[drive]\nkind = "force"\nforce = "1 N"\nfrequency = "220 Hz"\ncycles = 100\n'
JOINT = ELASTIC_JOINT + DRIVE


def find_steady_amplitude(force: float, frequency: float) -> float:
    """Return the steady amplitude [m] of the joint while it sticks, a mode of two springs with one damper."""
    omega = 2 * np.pi * frequency
    stiffness = 1.3 * (2 * np.pi * 195) ** 2 + 2e5
    damping = 2 * 0.002 * 2 * np.pi * 195 * 1.3
    return force / abs(stiffness - 1.3 * omega**2 + 1j * omega * damping)


def test_sticking_cases_that_still_vibrate_are_transient():
    """A sticking joint after 100 cycles is transient in a run and in sweeps of both kinds; its steady amplitude is right.

    After 2000 cycles it is stuck.
    """
    one = pf.run(JOINT)
    assert one.outcome == "transient"
    few = pf.sweep(pf.load(JOINT), {"drive.force": ["1 N", "2 N"]})
    many = pf.sweep(pf.load(JOINT), {"drive.force": [f"{1 + k / 100} N" for k in range(80)]})
    for sweep in (few, many):
        assert set(sweep["outcome"].values) == {"transient"}
        values = sweep["relative_displacement_amplitude_steady"].values
        errors = sweep["relative_displacement_amplitude_steady_error"].values
        forces = sweep["drive_force"].values
        true = np.array([find_steady_amplitude(force, 220.0) for force in forces])
        assert (np.abs(values - true) <= errors + 1e-6 * true).all()
    assert pf.run(JOINT, **{"drive.cycles": 2000}).outcome == "stuck"


def test_always_round_off_is_shown_as_zero_and_missed_measures_are_counted():
    """A value of round-off beside large ones is 0, and a sentence says of which measures the tolerance is missed."""
    columns = {
        "slip_amplitude": np.array([3.6e-27, 1e-6, 2e-6]),
        "loop_area": np.array([1.0, 2.0, 3.0]),
    }
    table = make_table({"normal.load": np.arange(1.0, 4.0)}, columns)
    analysis = analyse(table)
    ranges = [row for row in analysis.ranges if row[0] == "slip_amplitude"]
    verdict = make_verdict(table, replace(analysis, ranges=ranges))
    assert "slip amplitude changes most: from 0 at 1 to" in verdict[0]

    missed = {"slip_amplitude": {"count": 2, "worst": 1.0}, "loop_area": {"count": 1, "worst": 1.0}}
    over = replace(analysis, cases=analysis.cases | {"over_tolerance": missed})
    text = "2 over the tolerance in slip amplitude (1 other measure also above it in some cases)"
    assert text in make_verdict(table, over)[-1]


def test_exact_single_settled_case_has_no_range():
    """A sweep of which one case settled states no range and no limit, also of a measure that only unsettled cases have."""
    outcome = np.array(["steady", "transient", "transient", "transient"], object)
    columns = {
        "loop_area": np.array([np.nan, 1.0, 2.0, 3.0]),
        "slip_amplitude": np.arange(1.0, 5.0),
    }
    table = make_table({"normal.load": np.arange(1.0, 5.0)}, columns, outcome=outcome)
    analysis = analyse(table)
    assert analysis.ranges == analysis.limits == []
    verdict = make_verdict(table, analysis)
    assert verdict[0] == "Only one of 4 cases settled, so that no change is known."
    table.outcome[:] = "steady"
    assert (
        "slip amplitude changes most: from 1 at 1 to 4 at 4"
        in make_verdict(table, analyse(table))[0]
    )
