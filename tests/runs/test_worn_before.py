"""A run that goes on from the worn depth of another: two halves are the whole, other conditions, refusals."""

import shutil

import numpy as np
import pytest
from command_line import cli
from test_worn_friction import ALPHA, AREA, DEPTH, LOAD, MU, PATH, SCENE

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.export import folder
from patchfem.runs.run import run
from patchfem.scene import loads

HALF = "wear.cycles=1e6"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with the scene as a.toml and the results of its first 1e6 cycles in one/."""
    folder = tmp_path_factory.mktemp("before")
    (folder / "a.toml").write_text(SCENE)
    ran(folder, HALF).save(folder / "one")
    return folder


def ran(folder, *sets):
    return pf.run(loads(SCENE, folder / "a.toml", sets))


def test_exact_two_halves_are_the_closed_form_of_the_whole(place):
    found = ran(place, HALF, "wear.start=one/result.nc")
    depth = DEPTH * -np.expm1(-ALPHA * MU * LOAD / AREA * PATH * 2e6 / DEPTH)
    volume = found.measures["worn_volume"]
    one = pf.load(place / "a.toml")
    assert abs(volume.value - depth * AREA) <= volume.error < 1e-3 * volume.value
    assert abs(found.measures["static_coefficient"].value - MU * (1 - depth / DEPTH)) <= 1e-3 * MU
    first = ran(place, HALF).measures["worn_volume"]
    assert volume.error > first.error and one.wear.start is None
    assert found.extra["wear"]["worn_volume"][0] == pytest.approx(first.value, rel=1e-12, abs=0)
    np.testing.assert_array_equal(found.extra["wear"]["cycle"][[0, -1]], [0, 1e6])


def test_exact_compare_states_the_cycles_of_the_run_before(place):
    ran(place, HALF, "wear.start=one/result.nc").save(place / "two")
    found = pf.compare(place / "one", place / "two")
    assert (
        "1e+06 cycles of wear after those of one/result.nc (the surface before: 1e+06 cycles)"
        in found["sentences"][0]
    )
    assert found["worn_depth_mean"]["value"] < 1.1e-6


def test_exact_volumes_add_where_the_path_and_the_friction_stay(place):
    """V = kappa N s n: of two runs under other strokes the sum, to 1e-12; the note tells what the run goes on from."""
    archard = [HALF, "wear.form=archard", "wear.friction.coefficient_factor=[1, 1]"]
    stroke = "slide.amplitude=5 um"
    one = ran(place, *archard)
    two = ran(place, *archard, stroke)
    one.save(place / "archard")
    found = ran(place, *archard, stroke, "wear.start=archard/result.nc")
    volume = sum(each.measures["worn_volume"].value for each in (one, two))
    assert found.measures["worn_volume"].value == pytest.approx(volume, rel=1e-12, abs=0)
    assert volume == pytest.approx(ALPHA * LOAD * 1.5 * PATH * 1e6, rel=1e-8, abs=0)
    assert "continues from archard/result.nc, where up to " in found.extra["notes"][-1]


def test_exact_a_run_goes_on_on_another_mesh(place):
    """The whole in one run and half of it carried to a finer mesh differ by less than their errors."""
    sets = "contact.crown.radius=50 m", "contact.element_size=0.4 mm"
    ran(place, HALF, sets[0]).save(place / "crown")
    found = ran(place, HALF, *sets, "wear.start=crown/result.nc").measures
    whole = ran(place, "wear.cycles=2e6", *sets).measures
    for name in ("worn_volume", "worn_depth_max", "static_coefficient"):
        assert (
            abs(found[name].value - whole[name].value) <= found[name].error + whole[name].error
        ), name
    assert found["worn_volume"].error < 1e-2 * whole["worn_volume"].value


def test_exact_a_sweep_goes_on_from_each_of_two_runs(place):
    ran(place, "wear.cycles=2e6").save(place / "long")
    swept = pf.sweep(
        loads(SCENE, place / "a.toml", [HALF]), {"wear.start": ["one/result.nc", "long/result.nc"]}
    )
    for value, file in zip(swept["worn_volume"].values, ("one", "long")):
        alone = ran(place, HALF, f"wear.start={file}/result.nc").measures["worn_volume"].value
        assert value == pytest.approx(alone, rel=1e-12, abs=0)


@pytest.mark.parametrize(
    "sets, told",
    [
        (["wear.start=one/summary.json"], "not the result.nc of a run with [wear]"),
        (["wear.start=new.nc"], "not the result.nc of a run with [wear]"),
        (
            ["wear.start=one/result.nc", "contact.length=10 mm", "wear.upper_share=0.6"],
            "are not those of this scene (contact.length, wear.upper_share differ",
        ),
        (["wear.start=nowhere.nc"], "there is no file"),
    ],
)
def test_refuses_what_is_no_worn_depth_of_these_pieces(place, sets, told):
    if not (place / "new.nc").exists():
        pf.run(loads(SCENE[: SCENE.index("[wear]")], place / "a.toml")).save(place / "new")
        shutil.copy(place / "new" / "result.nc", place / "new.nc")
    answer = cli("check", place / "a.toml", *(word for one in sets for word in ("--set", one)))
    assert answer.code == 2 and told in answer.err and "Traceback" not in answer.err


def test_refuses_a_trace_that_was_not_worn(place):
    """The surfaces are compared, not what they are called: a profile in place of none."""
    rows = (f"{x},{(x / 6400 - 1) ** 2}" for x in range(0, 12801, 100))
    (place / "bulge.csv").write_text("\n".join(("x_um,z_um", *rows)))
    scene = loads(
        SCENE, place / "a.toml", ["wear.start=one/result.nc", "contact.profile.file=bulge.csv"]
    )
    with pytest.raises(
        PatchfemError, match="the unworn surfaces of that run differ from those of this scene"
    ):
        pf.run(scene)


def test_exact_without_an_error_before_the_error_is_not_known(place):
    folder.save_run(run(loads(SCENE, place / "a.toml", [HALF]), estimate=False), place / "rough")
    assert ran(place, HALF, "wear.start=rough/result.nc").measures["worn_volume"].error is None


def test_refuses_to_go_on_where_the_coating_is_gone(place):
    coat = (
        'substrate = "Ti-8Al-1Mo-1V"\n[contact.coating]\nmaterial = "WC-Co"\nthickness = "0.5 um"\n'
    )
    coated = SCENE.replace('substrate = "Ti-8Al-1Mo-1V"\n', coat)
    pf.run(loads(coated, place / "a.toml", [HALF])).save(place / "gone")
    with pytest.raises(PatchfemError, match="the coating of the upper piece was worn through;"):
        pf.run(loads(coated, place / "a.toml", ["wear.start=gone/result.nc"]))
