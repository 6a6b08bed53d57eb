"""Scenes behind elastic-plastic elements: exact from yield to yield beside the march, chosen where it is cheaper."""

from __future__ import annotations

import pytest
from march_paths import share_one_loop
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
    friction_of,
    only,
)

import patchfem as pf

IWAN = friction_of("iwan")
RIG = POINT + PLASTIC + MODE + DRIVE
# of the same size as round-off
ROUND = ("energy_balance", "work_check", "energy_created", "drift_per_cycle")


def both(text, *sets):
    """Results of the exact engine and of the march."""
    keys = dict(one.split("=", 1) for one in sets)
    return [pf.run(text, **keys, **{"accuracy.method": method}) for method in ("exact", "march")]


def agree(exact, march, *besides):
    """Measures of a march whose errors do not hold the exact values; [] if it is a single one of some twenty."""
    assert exact.extra["engine"] == "piecewise" and march.extra["engine"] == "march"
    # the map of the yields finds it where samples cannot
    steady = {"relative_displacement_amplitude_steady"}
    assert set(exact.measures) - steady == set(march.measures) - steady
    out = []
    for name, other in march.measures.items():
        mine = exact.measures.get(name, other)
        if name in (*ROUND, *besides) or mine.value is None or other.value is None:
            continue
        if abs(mine.value - other.value) > 1.5 * (other.error or 0.0) + mine.error + other.floor:
            out.append((name, mine.value, other.value, other.error))
    return out if len(out) > 1 else []


@pytest.mark.share(1, 3)
@pytest.mark.parametrize(
    "sets",
    [(), ("drive.cycles=20.3",), ("drive.acceleration=2 g",), ("structure.mode.axial.damping=3",)],
)
def test_exact_rig_of_one_spring_is_inside_the_bars_of_the_march(sets):
    exact, march = both(RIG, "accuracy.tolerance=1e-4", *sets)
    assert agree(exact, march) == []
    assert exact.measures["energy_balance"].value < 1e-12
    # which is extrapolated
    assert all(
        m.error <= 1e-8 * abs(m.value) + m.floor
        for name, m in exact.measures.items()
        if m.value is not None and not name.endswith("_steady")
    )
    if not sets:
        assert exact.measures["stick_fraction"].value == pytest.approx(
            march.measures["stick_fraction"].value, abs=4e-3
        )


def test_exact_two_modes_and_a_release():
    exact, march = both(
        POINT + PLASTIC + MODE + SECOND + DRIVE, "drive.cycles=12", "accuracy.tolerance=1e-4"
    )
    assert agree(exact, march) == []
    free = (
        RIG[: RIG.index("[drive]")]
        + '[drive]\nkind = "free"\ndisplacement = "0.3 mm"\ncycles = 12\n'
    )
    exact, march = both(free, "accuracy.tolerance=1e-4")
    assert agree(exact, march) == []
    assert exact.outcome == march.outcome


def test_exact_two_interfaces_between_masses(monkeypatch):
    share_one_loop(monkeypatch)
    exact, march = both(PAIR + FORCED, "accuracy.tolerance=1e-4")
    assert agree(exact, march) == []
    assert (
        exact.measures["slip_amplitude_2"].error <= 1e-9 * exact.measures["slip_amplitude_2"].value
    )


def test_exact_a_level_of_a_patch_carries_the_error_of_its_mesh():
    """The first level has the bars of a run at its force alone but for what rings on from its start, the last those of
    the run; the onset lies within the bars of both meshes. The bars were 1e-9 of the values once."""
    text = (
        '[contact]\nlength = "40 mm"\nwidth = "30 mm"\nheight = "10 mm"\nload = "6 kN"\nsubstrate = "steel"\n'
        '[contact.crown]\nradius = "100 m"\n[contact.shear]\n'
        + COULOMB
        + KILOGRAM
        + '[drive]\nkind = "force"\nfrequency = "90 Hz"\ncycles = 10\n'
    )
    alone = pf.run(text + 'force = "600 N"\n[accuracy]\ntolerance = 1e-2').measures
    levels = (
        text
        + 'waveform = "levels"\nonset = "slip"\nlevels = ["600 N", "1200 N"]\n[accuracy]\ntolerance = '
    )
    coarse, fine = (pf.run(levels + tolerance) for tolerance in ("1e-2", "1e-3"))
    first, last = coarse.extra["levels"]
    for name, value in last.values.items():
        assert last.errors[name] == pytest.approx(
            coarse.measures[name].error, rel=1e-6, abs=3e-9 * abs(value)
        ), name
    assert all(1 / 4 < first.errors[name] / alone[name].error < 4 for name in first.values)
    a, b = (one.measures["onset_level"] for one in (coarse, fine))
    assert abs(a.value - b.value) <= a.error + b.error and a.error < 0.05 * a.value
    assert any(
        "onset_level: slip counts only if its amplitude" in note for note in coarse.extra["notes"]
    )


def test_always_auto_takes_the_cheaper_engine():
    def engine(text, **keys):
        return pf.plan(
            pf.load(text + "".join(f"[accuracy]\n{k} = {v}\n" for k, v in keys.items()))
        ).engine

    assert engine(RIG) == "piecewise"
    # up to seconds the exact motion is taken
    assert engine(RIG.replace("1 um", "1e-7 um")) == "piecewise"
    # a spring so stiff that it rings without end
    assert engine(RIG.replace("1 um", "1e-9 um")) == "march"
    assert engine(POINT + IWAN + MODE + DRIVE) == "piecewise"  # 49 cells, as the tolerance asks for
    many = COATED.replace("0.5 mm", "10 um") + SHEAR + PLASTIC + KILOGRAM + DRIVE
    # 1271 elements slip one after the other: a finer mesh is no worse motion
    assert engine(many) == "piecewise"
    longer = many.replace("cycles = ", "cycles = 100")
    assert engine(longer) == "march" and engine(longer, tolerance="1e-5") == "piecewise"
    assert engine(RIG, steps_per_cycle="400") == "march"  # steps that are named are taken
    assert engine(POINT + PLASTIC + MODE + SWEEP) == "piecewise"
    assert (
        engine(POINT + PLASTIC + MODE + '[structure.stiffening]\ncubic = "1e12 N/m^3"\n' + DRIVE)
        == "march"
    )


def test_refuses_an_exact_run_without_end():
    stiff = RIG.replace("1 um", "1e-13 um") + '[accuracy]\nmethod = "exact"\n'
    said = r"more than the limit of \d+ s; lower drive.cycles or the stiffness of"
    with pytest.raises(pf.Missing, match=said) as found:
        pf.run(stiff)
    march = pf.plan(stiff, **{"accuracy.method": "march"}).seconds
    seconds = float(str(found.value).partition("computing time of about ")[2].split(" s")[0])
    assert ("accuracy.method" in str(found.value)) == (march < seconds)


def test_refuses_exact_where_a_spring_bends_or_the_load_changes():
    exact = '[accuracy]\nmethod = "exact"\n'
    bends = (
        POINT + PLASTIC + MODE + '[structure.stiffening]\ncubic = "1e12 N/m^3"\n' + DRIVE + exact
    )
    assert "no exact solution exists with [structure.stiffening]" in only(bends)
    varies = POINT + 'amplitude = "10 N"\nfrequency = "20 Hz"\n' + PLASTIC + MODE + DRIVE + exact
    assert "no exact solution exists with normal.amplitude" in only(varies)
    assert "no exact solution exists for law 'tanh'" in only(
        POINT
        + '[friction]\nlaw = "tanh"\nstatic = 0.3\nreference_speed = "1 mm/s"\n'
        + MODE
        + DRIVE
        + exact
    )
