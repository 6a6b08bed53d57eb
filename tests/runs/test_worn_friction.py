"""Friction that changes with the worn depth: run-in in closed form, wear steps and table rows,
refusals."""

import numpy as np
import pytest

import patchfem as pf
from patchfem import SceneError
from patchfem.formatting import format_length
from patchfem.runs import compute_wear
from patchfem.runs.patch.result import solve_with_coarser
from patchfem.scene import loads

LOAD, AREA, PATH = 26 * 4.4482216152605, 12.7e-3**2, 40e-6
ALPHA, MU, DEPTH, CYCLES = 1e-13, 0.4, 10e-6, 5e6  # Friction falls to zero at the depth DEPTH [m].
SCENE = f"""
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
element_size = "0.8 mm"
substrate = "Ti-8Al-1Mo-1V"
[contact.tilt]
angle = "0.02 mrad"
[friction]
law = "elastic-plastic"
bond_length = "1e-8 um"
static = {MU}
[slide]
kind = "sine"
amplitude = "10 um"
frequency = "143 Hz"
cycles = 2
[wear]
coefficient = "{ALPHA} m^2/N"
cycles = {CYCLES:g}
form = "energy"
[wear.friction]
depth = ["0 um", "8 um"]
coefficient_factor = [1, 0.2]
[accuracy]
tolerance = 1e-2
"""
TABLE = [
    'wear.friction.depth=["0 um","0.5 um","1 um","4 um"]',
    "wear.friction.coefficient_factor=[1,1.5,1,1]",
]


def run_scene(*sets):
    """Return the result of the scene with --set options."""
    return pf.run(loads(SCENE, "a.toml", sets))


def test_exact_run_in_agrees_with_exponential_closed_form():
    """The mean worn depth agrees with h = H (1 - exp(-alpha mu_0 p s n/H)), the solution of dh/dn =
    alpha mu_0 (1 - h/H) p s, at every wear step."""
    tolerance = 1e-3
    result = run_scene(f"accuracy.tolerance={tolerance}")
    coefficient = result.measures["static_coefficient"]
    volume = result.measures["worn_volume"]
    history = result.wear.columns
    depth = DEPTH * -np.expm1(-ALPHA * MU * LOAD / AREA * PATH * history["cycle"] / DEPTH)
    assert abs(volume.value - depth[-1] * AREA) <= volume.error < tolerance * volume.value
    assert history["worn_volume"] == pytest.approx(depth * AREA, rel=tolerance, abs=0)
    assert (
        abs(coefficient.value - MU * (1 - depth[-1] / DEPTH)) <= coefficient.error < tolerance * MU
    )
    assert coefficient.value < 0.7 * MU
    loop = result.measures["loop_area"]
    assert (
        abs(loop.value - PATH * LOAD * MU * (1 - depth[-1] / DEPTH))
        <= loop.error
        < tolerance * loop.value
    )


def test_always_wear_steps_resolve_rows_of_friction_table():
    """Automatic wear steps resolve a peak of friction between two depths; prescribed steps that pass two rows give a
    warning."""
    model = pf.build(
        loads(SCENE, "a.toml", [*TABLE, "wear.cycles=1e6", "contact.element_size=0.1 mm"])
    )
    patch = solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
    moments = compute_wear(model, patch, (None, None)).moments
    assert max(item.values["static_coefficient"] for item in moments) > 1.4 * MU
    two_steps = run_scene(*TABLE, "wear.cycles=2e6", "wear.jumps=2")
    assert [
        item
        for item in two_steps.warnings
        if "one jump of the wear passes 2 rows of the table wear.friction" in item
    ]


def test_bond_length_follows_worn_depth():
    """The bond length follows the table over the worn depth, and the loop area is that of this bond length."""
    result = run_scene(
        "wear.form=archard",
        "friction.bond_length=4 um",
        "wear.cycles=1e6",
        "wear.friction.coefficient_factor=[1,1]",
        "wear.friction.bond_length_factor=[1,0.1]",
    )
    factor = 1 - 0.9 * result.measures["worn_volume"].value / AREA / 8e-6
    assert result.measures["bond_length"].value == pytest.approx(4e-6 * factor, rel=1e-12, abs=0)
    assert factor < 0.81
    # Loop area of an elastic-plastic element: 4 mu N (a - eps).
    assert result.measures["loop_area"].value == pytest.approx(
        4 * MU * LOAD * (10e-6 - 4e-6 * factor), rel=1e-3
    )


def test_always_wear_beyond_friction_table_gives_warning():
    """Beyond the last depth of the table friction stays constant, and a warning says so."""
    result = run_scene(
        'wear.friction.depth=["0 um","1 um"]',
        "wear.friction.coefficient_factor=[1,0.9]",
        "wear.cycles=2e6",
        "wear.jumps=4",
    )
    assert result.measures["static_coefficient"].value == pytest.approx(0.9 * MU, rel=1e-12)
    depth = format_length(result.measures["worn_volume"].value / AREA, 3)
    (warning,) = [text for text in result.warnings if "wear.friction.depth, 1 um," in text]
    assert warning.startswith(f"the mean worn depth, {depth}, is larger than the last value")
    assert warning.endswith(f"extend the table wear.friction to a depth of at least {depth}")


@pytest.mark.parametrize(
    "sets, message",
    [
        (
            ['wear.friction.depth=["1 um","2 um"]'],
            "wear.friction.depth: depths that rise from 0 are needed",
        ),
        (
            ['wear.friction.depth=["0 um","1 um","3 um"]'],
            "2 values for 3 values of `depth`; give one value for each",
        ),
        (
            ["wear.friction.coefficient_factor=[1.1,2]"],
            "the first factor must be 1, not 1.1, because [friction] itself",
        ),
        (
            ["friction.law=coulomb", "wear.friction.bond_length_factor=[1,2]"],
            "law 'coulomb' has no bond_length",
        ),
        (
            [
                "contact.grooves.wavelength=80 um",
                "contact.grooves.amplitude=20 um",
                "wear.friction.coefficient_factor=[1,2]",
            ],
            "lock on the flanks of the unworn grooves (slope 1.5708); factors below 1.59155 are needed",
        ),
    ],
)
def test_refuses_faulty_friction_table(sets, message):
    """A faulty table of friction over depth is refused with its key and cause."""
    with pytest.raises(SceneError) as error:
        loads(SCENE, "a.toml", sets)
    assert message in str(error.value)
