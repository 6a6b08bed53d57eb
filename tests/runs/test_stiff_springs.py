"""The law elastic-plastic with a given stiffness agrees with the equivalent bond length, in every
kind of run.

In a sweep of the load the stiffness stays constant.
"""

import numpy as np
import pytest
from scene_texts import FORCED, MODE, PAIR, POINT, SHEAR, SMALL_PATCH, TRIANGLE, list_mistakes

import patchfem as pf
from patchfem.scene import loads

LOAD, STIFFNESS = 26 * 0.45359237 * 9.80665, 7e6  # Load [N] and stiffness [N/m].
LAW = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\n'
DRIVE = '[drive]\nkind = "base"\nfrequency = "180 Hz"\nacceleration = "8 g"\ncycles = 20\n'
RIG = POINT + LAW + MODE + DRIVE
RUNS = {
    "a point on a bench": POINT + LAW + TRIANGLE,
    "a patch that gives way": SMALL_PATCH + SHEAR + LAW + TRIANGLE,
    "a balance": RIG + '[accuracy]\nmethod = "harmonic"\n',
    "modes of a bolted rig": RIG.replace('"0.884 kg"', '"0.884 kg"\nmeasured = "stuck"').replace(
        "143", "800"
    ),
    "masses": PAIR.replace('bond_length = "5 um"\n', "%s").replace(LAW, "") + FORCED,
}


def format_both_ways(text: str) -> tuple:
    """Return the scene with the stiffness, and the same scene with the equivalent bond length."""
    stiffness_key = f'stiffness = "{STIFFNESS} N/m"\n'
    length_key = 'bond_length = "{!r} m"\n'
    if "%s" in text:
        return text.replace("%s", stiffness_key), text.replace(
            "%s", length_key.format(0.3 * 60 / STIFFNESS)
        )
    return text.replace(LAW, LAW + stiffness_key), text.replace(
        LAW, LAW + length_key.format(0.3 * LOAD / STIFFNESS)
    )


@pytest.mark.parametrize("name", RUNS)
def test_exact_stiffness_agrees_with_equivalent_bond_length(name):
    """A stiffness and the bond length mu N/stiffness give the same measures, in every kind of run."""
    with_stiffness, with_length = (pf.run(loads(text)) for text in format_both_ways(RUNS[name]))
    assert (
        with_stiffness.outcome == with_length.outcome
        and with_stiffness.measures.keys() == with_length.measures.keys()
    )
    for key, measure in with_stiffness.measures.items():
        if measure.value is not None:
            assert measure.value == pytest.approx(
                with_length.measures[key].value, rel=1e-9, abs=1e-15, nan_ok=True
            ), key


def test_exact_load_sweep_keeps_stiffness():
    """In a sweep of 64 loads in lanes, the secant stiffness of the stuck cases is the given
    stiffness, and the others agree with single runs."""
    values = np.geomspace(20, 5e3, 64)
    sweep = pf.sweep(loads(format_both_ways(RIG)[0]), {"normal.load": values})
    for case in (0, 20, 40, 63):
        single = pf.run(
            loads(format_both_ways(RIG)[1]),
            **{"normal.load": values[case], "friction.bond_length": 0.3 * values[case] / STIFFNESS},
        )
        for name in ("friction_force_peak", "relative_displacement_amplitude", "loop_area"):
            error = float(sweep[f"{name}_error"][case]) + single.measures[name].error
            assert abs(float(sweep[name][case]) - single.measures[name].value) <= error + 1e-12, (
                case,
                name,
            )
    is_stuck = sweep["outcome"].values == "stuck"
    np.testing.assert_allclose(sweep["secant_stiffness"].values[is_stuck], STIFFNESS, rtol=1e-6)
    assert 5 < is_stuck.sum() < 60


@pytest.mark.parametrize(
    "sets, key, message",
    [
        (
            ["friction.bond_length=1 um"],
            "friction.stiffness",
            "`bond_length` and `stiffness` exclude each other",
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
def test_refuses_stiffness_with_incompatible_keys(sets, key, message):
    """A stiffness is refused with a bond length, a varying load, grooves and zero friction."""
    text = format_both_ways(RIG)[0]
    messages = list_mistakes(format_both_ways(RIG)[0], *sets)
    assert len(messages) == 1 and f": {key}: " in messages[0] and message in messages[0]
    if "give" in message:  # The advice of the message works.
        loads(
            text.replace(f'stiffness = "{STIFFNESS} N/m"', 'bond_length = "5 um"'), "a.toml", sets
        )
