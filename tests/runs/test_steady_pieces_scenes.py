"""Scenes with elastic-plastic elements whose steady state is found from yield event to yield event."""

import numpy as np
import pytest
from support.scene_texts import (
    DRIVE,
    FORCED,
    MODE,
    PAIR,
    PLASTIC,
    POINT,
    SECOND,
)

import patchfem as pf

RIG = POINT + PLASTIC + MODE + DRIVE
STEADY = {"accuracy.method": "harmonic"}
WORK_MEASURES = (
    "friction_work",
    "energy_stored",
    "energy_dissipated",
)  # Measures of the whole run.
ROUND_OFF_MEASURES = (
    "drift_per_cycle",
    "energy_balance",
    "work_check",
)  # Measures that consist of round-off.


def list_differences(steady, run, rel_tol=1e-8):
    """Return the measures of a long run that differ from those of its steady state."""
    return [
        (name, m.value, steady.measures[name].value)
        for name, m in run.measures.items()
        if name in steady.measures
        and name not in (*ROUND_OFF_MEASURES, *WORK_MEASURES)
        and m.value is not None
        and abs(m.value - steady.measures[name].value) > rel_tol * abs(m.value) + 1e-14
    ]


@pytest.mark.parametrize(
    ("text", "cycles"),
    [(POINT + PLASTIC + MODE + SECOND + DRIVE, 300), (PAIR + FORCED, 300)],
    ids=["two modes", "two interfaces"],
)
def test_exact_long_run_settles_to_steady_state(text, cycles):
    """A run of 300 cycles settles to the steady state of the harmonic engine within 1e-8."""
    steady = pf.run(text, **STEADY)
    run = pf.run(text, **{"accuracy.method": "exact", "drive.cycles": str(cycles)})
    assert steady.outcome == run.outcome == "steady" and steady.settings.map == "shooting"
    assert list_differences(steady, run) == []
    assert steady.measures["loop_area"].value == pytest.approx(
        run.measures["loop_area"].value, rel=1e-9
    )
    assert (
        steady.measures["relative_displacement_amplitude"].error
        < 1e-7 * run.measures["relative_displacement_amplitude"].value
    )
    assert (
        np.abs(steady.motion.steady.multipliers).max() < 1 and steady.motion.steady.residual < 1e-9
    )
