"""Laws of one point from the loops of a patch."""

import json

import numpy as np
import pytest
from command_line import run_cli
from scene_texts import DRIVE, KILOGRAM, PIECE, POINT, make_friction_table

import patchfem as pf
from patchfem.campaigns import fit_patch
from patchfem.campaigns.fits.patch_laws import Curves, LawProblem
from patchfem.formatting import format_number, format_quantity
from patchfem.friction import steady_loop
from patchfem.scene import Friction

SLIDE = '[slide]\nkind = "triangle"\namplitude = "10 um"\nspeed = "5 mm/s"\n'
CROWN = (
    PIECE
    + 'load = "26 lbf"\nelement_size = "0.2 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n[contact.crown]\n'
    'radius = "10 m"\n'
)
JOINT = CROWN + "[contact.shear]\n" + make_friction_table("coulomb")
RIG = JOINT + KILOGRAM + DRIVE
WINKLER = (
    PIECE
    + """load = "26 lbf"
element_size = "0.05 mm"
substrate = {young = "1e20 Pa", poisson = 0.3, density = "4000 kg/m^3"}
[contact.load_line]
offset = "2.1166666666666667 mm"
[contact.asperities]
law = "linear"
normal_stiffness = "1e12 Pa/m"
tangential_ratio = 0.8
"""
    + make_friction_table("coulomb")
    + SLIDE
)


@pytest.mark.parametrize(
    "law, keys",
    [
        ("iwan", {"stiffness": 3.3e6, "chi": -0.62, "beta": 0.4}),
        ("iwan", {"stiffness": 8e6, "chi": -0.2, "beta": 3.0}),
        ("bouc-wen", {"stiffness": 4e6, "exponent": 1.7, "shape": 0.8}),
        ("elastic-plastic", {"bond_length": 7e-6}),
    ],
)
def test_exact_a_law_finds_itself_in_its_own_loops(law, keys):
    own = Friction.model_construct(law=law, static=0.3, **keys)
    slides = np.geomspace(2e-7, 6e-5, 20)
    target = Curves(*steady_loop(own, 100.0, slides))
    found = LawProblem(law, 0.3, 100.0, slides, target, 5e6).solve()
    assert found.values == pytest.approx(keys, rel=1e-6)
    assert np.abs(found.deviations).max() < 1e-6


def test_a_mesh_is_refined_until_the_exponent_of_mindlins_contact_is_known():
    """A crowned strip loses energy with the third power of a small slide, chi = 0. A pinned mesh that leaves the loss
    open is told, and what is told serves."""
    pinned = fit_patch(pf.load(JOINT + SLIDE))
    assert "energy loss has an error" in pinned.warnings[0]
    assert "leave contact.element_size out" in pinned.warnings[0]
    found = fit_patch(pf.load(JOINT.replace('element_size = "0.2 mm"\n', "") + SLIDE))
    assert found.laws["iwan"].values["chi"] > -0.02 and not found.warnings
    assert found.patch.nodes > 2 * pinned.patch.nodes
    assert np.sqrt(np.mean(found.patch.mesh_change[1] ** 2)) < 0.1


def test_exact_a_rough_wedge_is_an_iwan_law():
    """Under a pressure that falls linearly to zero the points behind a linear skin slip one after the other at slides
    that are spread evenly: chi = 0 and no last slider, K = k_t A."""
    found = fit_patch(pf.load(WINKLER), np.geomspace(5e-8, 1e-6, 12))
    one = found.laws["iwan"]
    assert one.values["chi"] == 0.0 and one.values["beta"] == pytest.approx(0.0, abs=2e-2)
    assert one.values["stiffness"] == pytest.approx(0.8e12 * 12.7e-3**2, rel=1e-3)
    assert np.abs(one.deviations).max() < 2e-3 and found.best == "iwan"


def test_a_rig_of_the_fitted_law_swings_as_that_of_the_patch(tmp_path):
    """Frequency and damping of both agree within the differences that the fit prints, for each of the laws."""
    answer = pf.fit(RIG, from_patch=True, out=tmp_path / "out")
    slides = np.geomspace(*answer["amplitudes"], answer["rows"])
    method = {"method": "quasi-static", "amplitudes": slides}
    patch = pf.backbone(RIG, **method)
    for law, one in answer["laws"].items():
        point = pf.backbone(tmp_path / f"out/scene.{law}.toml", **method)
        f, zeta = (
            point[f"quasi_static_{name}"].values / patch[f"quasi_static_{name}"].values - 1
            for name in ("frequency", "damping")
        )
        stiffness, loss = (abs(one[part]["largest"]) for part in ("stiffness", "dissipation"))
        assert np.abs(f).max() <= 1 - np.sqrt(1 - stiffness)
        assert np.abs(zeta).max() <= (1 + loss) / (1 - stiffness) - 1
        assert np.abs(f).max() > 0.2 * stiffness  # the mode rests on the contact
    runs = [
        pf.run(scene, **{"drive.acceleration": "1 g"})
        .measures["relative_displacement_amplitude"]
        .value
        for scene in (RIG, tmp_path / "out/scene.fitted.toml")
    ]
    assert runs[1] == pytest.approx(
        runs[0], rel=abs(answer["laws"][answer["law"]]["stiffness"]["largest"])
    )


@pytest.mark.parametrize(
    "table",
    [
        '[contact.strips]\ncount = 3\nroll = "1 urad"\n',
        '[contact.holder]\ntangential_stiffness = "5e6 N/m"\n',
    ],
    ids=["strips", "holder"],
)
def test_exact_the_slip_force_is_that_of_the_load(table):
    """Whatever gives way, all elements together slip at mu N, which each law keeps."""
    found = fit_patch(
        pf.load(RIG.replace("[contact.shear]\n", "[contact.shear]\n" + table)), [1e-8, 1e-6, 1e-4]
    )
    assert found.patch.slip_force == pytest.approx(0.3 * found.patch.load, rel=1e-9)
    assert all(
        one.curves.force[-1] == pytest.approx(found.patch.slip_force, rel=1e-6)
        for one in found.laws.values()
    )


def test_the_verb_prints_what_a_law_leaves_out(tmp_path, monkeypatch):
    """The differences that are printed are those of the table of loops."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bench.toml").write_text(JOINT + SLIDE)
    answer = run_cli(
        "fit", "bench.toml", "--from-patch", "--amplitudes", "10 nm..200 nm:9", "-o", "out"
    )
    assert answer.code == 0, answer.err
    law = json.loads((tmp_path / "out/fit.json").read_text())["law"].replace("-", "")
    rows = np.genfromtxt(tmp_path / "out/fit.csv", delimiter=",", names=True)
    for part, name, unit in (("stiffness", "force", "N"), ("energy loss per cycle", "loss", "J")):
        own = rows[f"patch_{name}_{unit}"]  # there is no loss at 10 nm, where no element slips
        off = rows[f"{law}_{name}_{unit}"] / np.where(own > 0, own, np.nan) - 1
        k = np.nanargmax(np.abs(off))
        size = f"{'+' if off[k] > 0 else ''}{format_number(100 * off[k], 2)} %"
        at = format_quantity(rows["slide_m"][k], "m", 3)
        assert f"{size} of the {part} (at {at})" in answer.out.split("\n")[0]
    assert {"scene.bouc-wen.toml", "scene.elastic-plastic.toml", "scene.iwan.toml"} <= {
        one.name for one in (tmp_path / "out").iterdir()
    }
    fitted, patch = (
        pf.run(one).measures["friction_force_peak"].value
        for one in (tmp_path / "out/scene.fitted.toml", JOINT + SLIDE)
    )
    assert fitted == pytest.approx(patch, rel=1e-6)
    # its own folder is replaced
    assert run_cli("fit", "bench.toml", "--from-patch", "-o", "out").code == 0


@pytest.mark.parametrize(
    "text, said, mended",
    [
        (POINT + make_friction_table("iwan") + SLIDE, "[contact]", JOINT + SLIDE),
        (CROWN, "[friction]", JOINT + SLIDE),
        (
            JOINT.replace('"coulomb"', '"nonlocal"\nbond_length = "1 um"') + SLIDE,
            "use law coulomb or elastic-plastic",
            JOINT + SLIDE,
        ),
        (JOINT.replace("[contact.shear]\n", "") + SLIDE, "add [contact.shear]", JOINT + SLIDE),
        (
            RIG.replace("slide = 1.0", "slide = 1.0\nnormal = 0.1").replace(
                '"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'
            ),
            "`normal`, `pitch` and `yaw` to 0",
            RIG.replace('"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'),
        ),
        (
            JOINT + SLIDE + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 10\n',
            "leave [wear] out",
            JOINT + SLIDE,
        ),
        (
            JOINT.replace('load = "26 lbf"', 'load = "0 N"') + SLIDE,
            "the normal load is 0",
            JOINT + SLIDE,
        ),
    ],
)
def test_refuses_a_patch_that_is_no_set_of_elements_with_the_remedy(text, said, mended):
    with pytest.raises(pf.PatchfemError) as wrong:
        fit_patch(pf.load(text))
    assert said in str(wrong.value)
    assert fit_patch(pf.load(mended), [1e-8, 5e-8, 2e-7]).laws


def test_refuses_words_that_do_not_stand_together():
    for given, said in (
        ({}, "from_patch alone"),
        ({"from_patch": True, "to": "a.csv"}, "from_patch alone"),
        ({"from_patch": True, "amplitudes": "1 um,2 um"}, "at least three"),
        ({"from_patch": True, "amplitudes": "1 s..2 s:4"}, "amplitudes"),
        ({"amplitudes": "1 um..2 um:4"}, "applies only to"),
        ({"from_patch": True, "hold": "a=1"}, "hold"),
    ):
        with pytest.raises(pf.PatchfemError, match=said):
            pf.fit(JOINT + SLIDE, **given)
