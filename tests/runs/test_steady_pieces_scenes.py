"""Scenes whose steady motion behind elastic-plastic elements is found by the map from yield to yield."""

import numpy as np
import pytest
from support.scene_texts import (
    COATED,
    DRIVE,
    FORCED,
    KILOGRAM,
    MODE,
    PAIR,
    PLASTIC,
    POINT,
    SECOND,
    SHEAR,
)

import patchfem as pf
from patchfem.export import summarise_run

RIG = POINT + PLASTIC + MODE + DRIVE
STEADY = {"accuracy.method": "harmonic"}
WORKS = ("friction_work", "energy_stored", "energy_dissipated")  # of the whole run
PHASES = ("drift_per_cycle", "energy_balance", "work_check")  # round-off


def agree(steady, run, share=1e-8):
    """Measures of a long run that are not those of its steady motion."""
    return [
        (name, m.value, steady.measures[name].value)
        for name, m in run.measures.items()
        if name in steady.measures
        and name not in (*PHASES, *WORKS)
        and m.value is not None
        and abs(m.value - steady.measures[name].value) > share * abs(m.value) + 1e-14
    ]


@pytest.mark.parametrize(
    ("text", "cycles"),
    [(RIG, 300), (POINT + PLASTIC + MODE + SECOND + DRIVE, 300), (PAIR + FORCED, 300)],
    ids=["one mode", "two modes", "two interfaces"],
)
def test_exact_a_long_run_ends_in_the_steady_motion(text, cycles):
    steady = pf.run(text, **STEADY)
    run = pf.run(text, **{"accuracy.method": "exact", "drive.cycles": str(cycles)})
    assert steady.outcome == run.outcome == "steady" and steady.extra["map"] == "yields"
    assert agree(steady, run) == []
    assert steady.measures["loop_area"].value == pytest.approx(
        run.measures["loop_area"].value, rel=1e-9
    )
    assert (
        steady.measures["relative_displacement_amplitude"].error
        < 1e-8 * run.measures["relative_displacement_amplitude"].value
    )
    assert np.abs(steady.extra["multipliers"]).max() < 1 and steady.extra["residual"] < 1e-12


def test_exact_the_balance_of_named_harmonics_is_within_its_bars():
    exact = pf.run(RIG, **STEADY)
    balance = pf.run(RIG, **STEADY, **{"accuracy.harmonics": "31"})
    assert "map" not in summarise_run(balance)["numerics"] and balance.extra["harmonics"] == 31
    assert summarise_run(exact)["numerics"]["map"] == "yields"
    for name in (
        "relative_displacement_amplitude",
        "slip_amplitude",
        "loop_area",
        "friction_force_peak",
    ):
        mine = exact.measures[name]
        other = balance.measures[name]
        assert abs(mine.value - other.value) <= other.error + mine.error, name
    first = np.abs(exact.extra["multipliers"][:2]), np.abs(balance.extra["multipliers"][:2])
    assert first[0] == pytest.approx(first[1], rel=1e-2)


def test_exact_a_patch_behind_its_shear_shows_its_own_stress():
    """The frames of the steady motion are those of a long run, node by node."""
    text = COATED + SHEAR + PLASTIC + KILOGRAM + DRIVE
    keys = {"contact.element_size": "0.4 mm"}
    keys |= {"drive.frequency": "120 Hz", "structure.mode.axial.damping": "0.05"}
    steady, run = (
        pf.run(text, **keys, **more)
        for more in (STEADY, {"accuracy.method": "exact", "drive.cycles": "120"})
    )
    assert steady.extra["map"] == "yields" and agree(steady, run, 1e-7) == []
    ours = steady.fields["shear_stress"][1:]
    theirs = run.fields["shear_stress"][1:]
    np.testing.assert_allclose(ours, theirs, atol=1e-7 * np.abs(theirs).max())
    assert steady.measures["relative_displacement_amplitude"].error > 0  # the mesh has its share


def test_refuses_no_motion_that_grows():
    """Below pi/4 an undamped mode at its own frequency is bounded by nothing: the balance says so."""
    with pytest.raises(pf.NotConverged, match="undamped mode"):
        pf.run(RIG, **STEADY, **{"structure.mode.axial.damping": "0", "drive.acceleration": "8 g"})


@pytest.mark.parametrize("level", ["6 g", "8 g"])
def test_exact_the_steady_amplitude_of_an_unsettled_run_is_that_of_the_map(level):
    """Thirty cycles at resonance are far from enough, beyond the knee too: the steady amplitude is that of the map."""
    run, steady = (
        pf.run(RIG, **{"drive.acceleration": level, "accuracy.method": method})
        for method in ("exact", "harmonic")
    )
    assert run.outcome == "transient"
    told, there = (
        one.measures[name]
        for one, name in (
            (run, "relative_displacement_amplitude_steady"),
            (steady, "relative_displacement_amplitude"),
        )
    )
    assert told.value == pytest.approx(there.value, rel=1e-9) and told.error < 1e-8 * told.value
    assert run.measures["relative_displacement_amplitude"].value < 0.9 * told.value
