"""Runs that start from the worn depth of an earlier run: agreement with one whole run, and
refusals."""

import numpy as np
import pytest
from command_line import run_cli
from test_worn_friction import ALPHA, AREA, DEPTH, LOAD, MU, PATH, SCENE

import patchfem as pf
from patchfem.scene import loads

HALF_CYCLES = "wear.cycles=1e6"


@pytest.fixture(scope="module")
def earlier_run_folder(tmp_path_factory):
    """Return a folder with the scene as a.toml and the results of its first 1e6 cycles in one/."""
    folder = tmp_path_factory.mktemp("before")
    (folder / "a.toml").write_text(SCENE)
    run_in_folder(folder, HALF_CYCLES).save(folder / "one")
    return folder


def run_in_folder(folder, *sets):
    """Return the result of the scene in a folder with --set options."""
    return pf.run(loads(SCENE, folder / "a.toml", sets))


def test_exact_two_half_runs_agree_with_closed_form(earlier_run_folder):
    """Two successive runs of half of the cycles agree with the closed form of the whole, and errors add up."""
    second = run_in_folder(earlier_run_folder, HALF_CYCLES, "wear.start=one/result.nc")
    depth = DEPTH * -np.expm1(-ALPHA * MU * LOAD / AREA * PATH * 2e6 / DEPTH)
    volume = second.measures["worn_volume"]
    scene = pf.load(earlier_run_folder / "a.toml")
    assert abs(volume.value - depth * AREA) <= volume.error < 1e-3 * volume.value
    assert abs(second.measures["static_coefficient"].value - MU * (1 - depth / DEPTH)) <= 1e-3 * MU
    first = run_in_folder(earlier_run_folder, HALF_CYCLES).measures["worn_volume"]
    assert volume.error > first.error and scene.wear.start is None
    assert second.wear.columns["worn_volume"][0] == pytest.approx(first.value, rel=1e-12, abs=0)
    np.testing.assert_array_equal(second.wear.columns["cycle"][[0, -1]], [0, 1e6])


def test_exact_run_continues_on_other_mesh(earlier_run_folder):
    """One whole run, and half of it continued on a finer mesh, differ by less than their errors."""
    sets = "contact.crown.radius=50 m", "contact.element_size=0.4 mm"
    run_in_folder(earlier_run_folder, HALF_CYCLES, sets[0]).save(earlier_run_folder / "crown")
    continued = run_in_folder(
        earlier_run_folder, HALF_CYCLES, *sets, "wear.start=crown/result.nc"
    ).measures
    whole_run = run_in_folder(earlier_run_folder, "wear.cycles=2e6", *sets).measures
    for name in ("worn_volume", "worn_depth_max", "static_coefficient"):
        assert (
            abs(continued[name].value - whole_run[name].value)
            <= continued[name].error + whole_run[name].error
        ), name
    assert continued["worn_volume"].error < 1e-2 * whole_run["worn_volume"].value


@pytest.mark.parametrize(
    "sets, message",
    [
        (["wear.start=one/summary.json"], "not the result.nc of a run with [wear]"),
        (
            ["wear.start=one/result.nc", "contact.length=10 mm", "wear.upper_share=0.6"],
            "are not those of this scene (contact.length, wear.upper_share differ",
        ),
        (["wear.start=nowhere.nc"], "there is no file"),
    ],
)
def test_refuses_worn_depth_of_other_pieces(earlier_run_folder, sets, message):
    """A file that is not a wear result, or belongs to other pieces, is refused with the keys that differ."""
    answer = run_cli(
        "check",
        earlier_run_folder / "a.toml",
        *(f"--set={assignment}" for assignment in sets),
    )
    assert answer.code == 2 and message in answer.err and "Traceback" not in answer.err


def test_refuses_wear_of_other_profile_or_worn_through_coating(earlier_run_folder):
    """The unworn surfaces are compared, not their file names, and a coating that was worn through cannot wear further."""
    rows = (f"{x},{(x / 6400 - 1) ** 2}" for x in range(0, 12801, 100))
    (earlier_run_folder / "bulge.csv").write_text("\n".join(("x_um,z_um", *rows)))
    sets = ["wear.start=one/result.nc", "contact.profile.file=bulge.csv"]
    with pytest.raises(
        pf.PatchfemError, match="unworn surfaces of that run differ from those of this scene"
    ):
        pf.run(loads(SCENE, earlier_run_folder / "a.toml", sets))
    coat = (
        'substrate = "Ti-8Al-1Mo-1V"\n[contact.coating]\nmaterial = "WC-Co"\nthickness = "0.5 um"\n'
    )
    coated = SCENE.replace('substrate = "Ti-8Al-1Mo-1V"\n', coat)
    pf.run(loads(coated, earlier_run_folder / "a.toml", [HALF_CYCLES])).save(
        earlier_run_folder / "gone"
    )
    with pytest.raises(pf.PatchfemError, match="the coating of the upper piece was worn through;"):
        pf.run(loads(coated, earlier_run_folder / "a.toml", ["wear.start=gone/result.nc"]))


FACE = """\
[contact]
length = "10 mm"
width = "6 mm"
height = "5 mm"
load = "100 N"
substrate = "steel"
[contact.area]
cells = 32
[contact.crown]
radius = "5 m"
[friction]
law = "coulomb"
static = 0.3
[slide]
kind = "sine"
amplitude = "50 um"
frequency = "20 Hz"
cycles = 2
[wear]
coefficient = "1e-14 m^2/N"
cycles = 1000
"""


@pytest.fixture(scope="module")
def worn_face(tmp_path_factory):
    """Return a folder with the results of half of the wear of a face in one/, and the largest depth of the whole wear."""
    folder = tmp_path_factory.mktemp("face")
    pf.run(loads(FACE, folder / "a.toml")).save(folder / "one")
    whole = pf.run(loads(FACE, folder / "a.toml", ["wear.cycles=2000"]))
    return folder, whole.measures["worn_depth_max"]


@pytest.mark.long
@pytest.mark.parametrize("cells", [32, 48])
def test_worn_face_continues_on_its_own_and_on_other_cells(worn_face, cells):
    """Two halves of the wear of a face agree with the whole run, and with Archard's volume k N s, within their errors."""
    folder, whole = worn_face
    sets = "wear.start=one/result.nc", f"contact.area.cells={cells}"
    found = pf.run(loads(FACE, folder / "a.toml", sets)).measures
    volume = found["worn_volume"]
    assert abs(volume.value - 1e-14 * 100 * 4 * 50e-6 * 2000) <= volume.error < 0.1 * volume.value
    depth = found["worn_depth_max"]
    assert abs(depth.value - whole.value) <= depth.error < 0.2 * depth.value
    message = "are not those of this scene .contact.width differ"
    with pytest.raises(pf.PatchfemError, match=message):
        pf.run(loads(FACE, folder / "a.toml", [*sets, "contact.width=5 mm"]))
