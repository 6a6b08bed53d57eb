"""Law elastic-plastic given its stiffness beside the bond length that makes one under the same load: every kind of run
gives the same answers, and a sweep of the load leaves the stiffness where it is."""

import numpy as np
import pytest
from scene_texts import FORCED, MODE, PAIR, POINT, SHEAR, SMALL_PATCH, TRIANGLE, mistakes

import patchfem as pf
from patchfem.scene import loads

LOAD, STIFF = 26 * 0.45359237 * 9.80665, 7e6  # N, N/m
LAW = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\n'
DRIVE = '[drive]\nkind = "base"\nfrequency = "180 Hz"\nacceleration = "8 g"\ncycles = 20\n'
RIG = POINT + LAW + MODE + DRIVE
RUNS = {
    "a point on a bench": POINT + LAW + TRIANGLE,
    "a patch": SMALL_PATCH + LAW + TRIANGLE,
    "a patch that gives way": SMALL_PATCH + SHEAR + LAW + TRIANGLE,
    "a rig": RIG,
    "a balance": RIG + '[accuracy]\nmethod = "harmonic"\n',
    "a march": RIG + '[accuracy]\nmethod = "march"\n',
    "a patch in a rig": SMALL_PATCH + SHEAR + LAW + MODE + DRIVE,
    "modes of a bolted rig": RIG.replace('"0.884 kg"', '"0.884 kg"\nmeasured = "stuck"').replace(
        "143", "800"
    ),
    "masses": PAIR.replace('bond_length = "5 um"\n', "%s").replace(LAW, "") + FORCED,
}


def both(text: str) -> tuple:
    """The scene with the stiffness, and with the bond length."""
    stiff = f'stiffness = "{STIFF} N/m"\n'
    length = 'bond_length = "{!r} m"\n'
    if "%s" in text:
        return text.replace("%s", stiff), text.replace("%s", length.format(0.3 * 60 / STIFF))
    return text.replace(LAW, LAW + stiff), text.replace(
        LAW, LAW + length.format(0.3 * LOAD / STIFF)
    )


@pytest.mark.parametrize("name", RUNS)
def test_exact_stiffness_and_bond_length_say_the_same(name):
    mine, theirs = (pf.run(loads(text)) for text in both(RUNS[name]))
    assert mine.outcome == theirs.outcome and mine.measures.keys() == theirs.measures.keys()
    for key, one in mine.measures.items():
        if one.value is not None:
            assert one.value == pytest.approx(
                theirs.measures[key].value, rel=1e-9, abs=1e-15, nan_ok=True
            ), key


def test_exact_a_sweep_of_the_load_leaves_the_stiffness():
    """Lanes of 64 loads: some held, whose force is STIFF times the slide, and some that slip."""
    values = np.geomspace(20, 5e3, 64)
    found = pf.sweep(loads(both(RIG)[0]), {"normal.load": values})
    for case in (0, 20, 40, 63):
        one = pf.run(
            loads(both(RIG)[1]),
            **{"normal.load": values[case], "friction.bond_length": 0.3 * values[case] / STIFF},
        )
        for name in ("friction_force_peak", "relative_displacement_amplitude", "loop_area"):
            error = float(found[f"{name}_error"][case]) + one.measures[name].error
            assert abs(float(found[name][case]) - one.measures[name].value) <= error + 1e-12, (
                case,
                name,
            )
    held = found["outcome"].values == "stuck"
    np.testing.assert_allclose(found["secant_stiffness"].values[held], STIFF, rtol=1e-6)
    assert 5 < held.sum() < 60


@pytest.mark.parametrize(
    "sets, key, says",
    [
        (
            ["friction.bond_length=1 um"],
            "friction.stiffness",
            "takes either this key or bond_length",
        ),
        (
            ["normal.amplitude=3 N", "normal.frequency=50 Hz"],
            "friction.stiffness",
            "give bond_length in",
        ),
        (
            ["normal.grooves.wavelength=80 um", "normal.grooves.amplitude=1 um"],
            "friction.stiffness",
            "give bond_length",
        ),
        (["friction.static=0"], "friction.static", "static: must be > 0"),
    ],
)
def test_refuses_a_stiffness_that_is_not_one(sets, key, says):
    text = both(RIG)[0]
    found = mistakes(both(RIG)[0], *sets)
    assert len(found) == 1 and f": {key}: " in found[0] and says in found[0]
    if "give" in says:  # what it says serves
        loads(text.replace(f'stiffness = "{STIFF} N/m"', 'bond_length = "5 um"'), "a.toml", sets)


def test_refuses_a_stiffness_under_an_approach_and_one_that_wears():
    text = both(SMALL_PATCH + LAW + TRIANGLE)[0].replace('load = "26 lbf"', "")
    text += '[contact.approach]\ndistance = "0.2 um"\n'
    assert "or contact.load in place of [contact.approach]" in mistakes(text)[0]
    worn = (
        both(SMALL_PATCH + LAW + TRIANGLE)[0]
        + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1e5\n'
        '[wear.friction]\ndepth = ["0 um", "1 um"]\nbond_length_factor = [1, 2]\n'
    )
    assert "give friction.bond_length" in mistakes(worn)[0]
