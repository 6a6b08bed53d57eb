"""Scenes with elastic-plastic elements: the exact engine, which steps between yield events, agrees with the march."""

from __future__ import annotations

import pytest
from support.scene_texts import (
    COATED,
    COULOMB,
    DRIVE,
    FORCED,
    KILOGRAM,
    MODE,
    PAIR,
    PLASTIC,
    POINT,
    SECOND,
    SHEAR,
    SWEEP,
    make_friction_table,
)

import patchfem as pf
from patchfem.runs.rig.costs import estimate_march_seconds

IWAN = make_friction_table("iwan")
RIG = POINT + PLASTIC + MODE + DRIVE
# Measures that consist of round-off.
ROUND_OFF_MEASURES = ("energy_balance", "work_check", "energy_created", "drift_per_cycle")


def run_exact_and_march(text, *sets):
    """Return the results of the exact engine and of the march."""
    keys = dict(assignment.split("=", 1) for assignment in sets)
    return [pf.run(text, **keys, **{"accuracy.method": method}) for method in ("exact", "march")]


def list_differences(exact, march, *ignored):
    """Return the measures whose difference exceeds the errors of exact engine and march; [] if it
    is a single one."""
    assert exact.extra["engine"] == "hybrid" and march.extra["engine"] == "march"
    # The exact engine estimates it from its events; samples cannot.
    steady = {"relative_displacement_amplitude_steady"}
    assert set(exact.measures) - steady == set(march.measures) - steady
    differences = []
    for name, march_measure in march.measures.items():
        exact_measure = exact.measures.get(name, march_measure)
        if (
            name in (*ROUND_OFF_MEASURES, *ignored)
            or exact_measure.value is None
            or march_measure.value is None
        ):
            continue
        if (
            abs(exact_measure.value - march_measure.value)
            > 1.5 * (march_measure.error or 0.0) + exact_measure.error + march_measure.floor
        ):
            differences.append(
                (name, exact_measure.value, march_measure.value, march_measure.error)
            )
    return differences if len(differences) > 1 else []


@pytest.mark.parametrize(
    "sets",
    [(), ("drive.cycles=20.3",)],
)
def test_exact_single_spring_rig_agrees_with_march(sets):
    """The exact engine agrees with the march within the errors of the march, and its own errors are at most 1e-8."""
    exact, march = run_exact_and_march(RIG, "accuracy.tolerance=1e-4", *sets)
    assert list_differences(exact, march) == []
    assert exact.measures["energy_balance"].value < 1e-10
    # The steady amplitude is extrapolated and has a larger error.
    assert all(
        m.error <= 1e-7 * abs(m.value) + m.floor
        for name, m in exact.measures.items()
        if m.value is not None and not name.endswith("_steady")
    )
    if not sets:
        assert exact.measures["stick_fraction"].value == pytest.approx(
            march.measures["stick_fraction"].value, abs=4e-3
        )


def test_exact_two_modes_and_release_agree_with_march():
    """The exact engine agrees with the march for two modes under a sine, and for a release."""
    exact, march = run_exact_and_march(
        POINT + PLASTIC + MODE + SECOND + DRIVE, "drive.cycles=12", "accuracy.tolerance=1e-4"
    )
    assert list_differences(exact, march) == []
    free = (
        RIG[: RIG.index("[drive]")]
        + '[drive]\nkind = "free"\ndisplacement = "0.3 mm"\ncycles = 12\n'
    )
    exact, march = run_exact_and_march(free, "accuracy.tolerance=1e-4")
    assert list_differences(exact, march) == []
    assert exact.outcome == march.outcome


def test_exact_two_interfaces_agree_with_march():
    """The exact engine agrees with the march for two interfaces between masses."""
    exact, march = run_exact_and_march(PAIR + FORCED, "accuracy.tolerance=1e-4")
    assert list_differences(exact, march) == []
    assert (
        exact.measures["slip_amplitude_2"].error <= 1e-7 * exact.measures["slip_amplitude_2"].value
    )


def test_exact_errors_of_levels_include_mesh_error():
    """The errors of a drive level of a patch include the error of the mesh: at the first level they
    agree within a factor of 4 with those of a single run, and at the last level with those of the
    final measures. The onset levels of two meshes agree within their errors.

    The errors were 1e-9 of the values in an earlier version.
    """
    text = (
        '[contact]\nlength = "40 mm"\nwidth = "30 mm"\nheight = "10 mm"\nload = "6 kN"\nsubstrate = "steel"\n'
        '[contact.crown]\nradius = "100 m"\n[contact.shear]\n'
        + COULOMB
        + KILOGRAM
        + '[drive]\nkind = "force"\nfrequency = "90 Hz"\ncycles = 10\n'
    )
    single_force = pf.run(text + 'force = "600 N"\n[accuracy]\ntolerance = 1e-2').measures
    levels = (
        text
        + 'waveform = "levels"\nonset = "slip"\nlevels = ["600 N", "1200 N"]\n[accuracy]\ntolerance = '
    )
    coarse, fine = (pf.run(levels + tolerance) for tolerance in ("1e-2", "1e-3"))
    first_level, last_level = coarse.extra["levels"]
    for name, value in last_level.values.items():
        assert last_level.errors[name] == pytest.approx(
            coarse.measures[name].error, rel=1e-6, abs=3e-9 * abs(value)
        ), name
    assert all(
        1 / 4 < first_level.errors[name] / single_force[name].error < 4
        for name in first_level.values
    )
    a, b = (result.measures["onset_level"] for result in (coarse, fine))
    assert abs(a.value - b.value) <= a.error + b.error and a.error < 0.05 * a.value
    assert any(
        "onset_level: slip counts only if its amplitude" in note for note in coarse.extra["notes"]
    )


def test_always_automatic_method_chooses_cheaper_engine():
    """The automatic method chooses the exact engine unless the march is cheaper or steps are prescribed."""

    def planned_engine(text, **keys):
        return pf.plan(
            pf.load(text + "".join(f"[accuracy]\n{k} = {v}\n" for k, v in keys.items()))
        ).engine

    assert planned_engine(RIG) == "hybrid"
    # A stiff spring whose free vibration has too many events.
    assert planned_engine(RIG.replace("1 um", "1e-9 um")) == "march"
    # The tolerance needs 49 cells.
    assert planned_engine(POINT + IWAN + MODE + DRIVE) == "hybrid"
    many_elements = COATED.replace("0.5 mm", "10 um") + SHEAR + PLASTIC + KILOGRAM + DRIVE
    # 1271 elements slip one after the other; a fine mesh does not make the motion more expensive.
    assert planned_engine(many_elements) == "hybrid"
    long_run = many_elements.replace("cycles = ", "cycles = 100")
    assert planned_engine(long_run) == "march"
    # A prescribed number of steps selects the march.
    assert planned_engine(RIG, steps_per_cycle="400") == "march"
    assert planned_engine(POINT + PLASTIC + MODE + SWEEP) == "hybrid"
    assert (
        planned_engine(
            POINT + PLASTIC + MODE + '[structure.stiffening]\ncubic = "1e12 N/m^3"\n' + DRIVE
        )
        == "hybrid"
    )


def test_refuses_exact_run_with_unlimited_cost():
    """An exact run with too many events is refused; the message advises the march only if this is cheaper."""
    text = RIG.replace("1 um", "1e-13 um") + '[accuracy]\nmethod = "exact"\n'
    pattern = r"more than the limit of \d+ s; lower drive.cycles or the stiffness of"
    with pytest.raises(pf.Missing, match=pattern) as error:
        pf.run(text)
    march = estimate_march_seconds(pf.build(text))
    seconds = float(str(error.value).partition("computing time of about ")[2].split(" s")[0])
    assert ("accuracy.method" in str(error.value)) == (march < seconds)
