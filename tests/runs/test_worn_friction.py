"""Friction that changes with the worn depth: a run-in in closed form, jumps and rows, resumed runs, refusals."""

import numpy as np
import pytest
from command_line import cli

import patchfem as pf
from patchfem import SceneError
from patchfem.runs import compute_wear
from patchfem.runs.patch.result import solve_with_coarser
from patchfem.runs.wear.plan import estimate_jumps
from patchfem.scene import loads

LOAD, AREA, PATH = 26 * 4.4482216152605, 12.7e-3**2, 40e-6
ALPHA, MU, DEPTH, CYCLES = 1e-13, 0.4, 10e-6, 5e6  # friction falls to nothing at DEPTH
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


def ran(*sets):
    return pf.run(loads(SCENE, "a.toml", sets))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_exact_friction_that_falls_with_wear_runs_in_exponentially(tolerance):
    """dh/dn = alpha mu_0 (1 - h/H) p s of the mean depth: h = H (1 - exp(-alpha mu_0 p s n/H)), at every jump."""
    found = ran(f"accuracy.tolerance={tolerance}")
    law = found.measures["static_coefficient"]
    volume = found.measures["worn_volume"]
    history = found.extra["wear"]
    depth = DEPTH * -np.expm1(-ALPHA * MU * LOAD / AREA * PATH * history["cycle"] / DEPTH)
    assert abs(volume.value - depth[-1] * AREA) <= volume.error < tolerance * volume.value
    assert history["worn_volume"] == pytest.approx(depth * AREA, rel=tolerance, abs=0)
    assert abs(law.value - MU * (1 - depth[-1] / DEPTH)) <= law.error < tolerance * MU
    assert law.value < 0.7 * MU
    loop = found.measures["loop_area"]
    assert (
        abs(loop.value - PATH * LOAD * MU * (1 - depth[-1] / DEPTH))
        <= loop.error
        < tolerance * loop.value
    )


def test_exact_archard_wear_leaves_the_volume_and_changes_the_loop():
    """The slide is prescribed, so Archard's volume is that of any friction, to round-off."""
    found = ran("wear.form=archard", "wear.friction.coefficient_factor=[1,1.8]", "wear.cycles=1e6")
    volume = ALPHA * LOAD * PATH * 1e6
    # bonds stretch by 1e-9
    assert found.measures["worn_volume"].value == pytest.approx(volume, rel=1e-8, abs=0)
    assert found.measures["friction_force_peak"].value == pytest.approx(
        MU * LOAD * (1 + 0.8 * volume / AREA / 8e-6), rel=1e-8
    )


def test_always_jumps_do_not_pass_a_row_unseen():
    """A peak of friction between two depths is seen by every automatic run; plan counts the jumps with it."""
    model = pf.build(
        loads(SCENE, "a.toml", [*TABLE, "wear.cycles=1e6", "contact.element_size=0.1 mm"])
    )
    patch = solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
    moments = compute_wear(model, patch, (None, None)).moments
    assert max(one.values["static_coefficient"] for one in moments) > 1.4 * MU
    assert 1 / 1.5 < estimate_jumps(model) / (len(moments) - 1) < 1.5
    few = ran(*TABLE, "wear.cycles=2e6", "wear.jumps=2")
    assert [
        one
        for one in few.warnings
        if "one jump of the wear passes 2 rows of the table wear.friction" in one
    ]


def test_exact_the_bond_length_changes_with_wear():
    found = ran(
        "wear.form=archard",
        "friction.bond_length=4 um",
        "wear.cycles=1e6",
        "wear.friction.coefficient_factor=[1,1]",
        "wear.friction.bond_length_factor=[1,0.1]",
    )
    grown = 1 - 0.9 * found.measures["worn_volume"].value / AREA / 8e-6
    assert found.measures["bond_length"].value == pytest.approx(4e-6 * grown, rel=1e-12, abs=0)
    assert grown < 0.81
    # elastic-plastic: loop 4 mu N (a - eps)
    assert found.measures["loop_area"].value == pytest.approx(
        4 * MU * LOAD * (10e-6 - 4e-6 * grown), rel=1e-3
    )


def test_always_wear_beyond_the_table_gives_a_warning():
    found = ran('wear.friction.depth=["0 um","1 um"]', "wear.friction.coefficient_factor=[1,0.9]")
    assert found.measures["static_coefficient"].value == pytest.approx(0.9 * MU, rel=1e-12)
    assert [
        one
        for one in found.warnings
        if "is larger than the last value of wear.friction.depth, 1 um" in one
    ]


@pytest.mark.parametrize(
    "sets, told",
    [
        (
            ['wear.friction.depth=["1 um","2 um"]'],
            "wear.friction.depth: depths that rise from 0 are needed",
        ),
        (
            ['wear.friction.depth=["0 um","1 um","3 um"]'],
            "2 factors for 3 depths; give one factor for each",
        ),
        (
            ['wear.friction.depth=["0 um"]'],
            "wear.friction.depth: at least 2 values are needed, not 1",
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
def test_refuses_a_table_that_makes_no_sense(sets, told):
    with pytest.raises(SceneError) as error:
        loads(SCENE, "a.toml", sets)
    assert told in str(error.value)


def test_refuses_friction_over_the_wear_of_a_point():
    text = '[normal]\nload = "100 N"\n' + SCENE[SCENE.index("[friction]") :]
    with pytest.raises(
        SceneError, match=r"wear.friction: a \[normal\] contact has no area.*: use \[contact\]"
    ):
        loads(text, "a.toml")


def test_exact_a_sweep_takes_tables(tmp_path):
    scene = tmp_path / "a.toml"
    scene.write_text(SCENE)
    answer = cli(
        "sweep",
        scene,
        "--over",
        "wear.friction.coefficient_factor=[1,1],[1,0.5]",
        "-o",
        tmp_path / "out",
        "-q",
        "--set",
        "wear.jumps=4",
        "--json",
    )
    assert answer.code == 0, answer.err
    rows = (tmp_path / "out" / "sweep.csv").read_text()
    assert '"[1,0.5]"' in rows and "static_coefficient" in rows
