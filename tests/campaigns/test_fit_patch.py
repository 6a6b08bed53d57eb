"""Tests of fitting a single-point friction law to the hysteresis loops of a patch."""

import numpy as np
import pytest
from scene_texts import DRIVE, KILOGRAM, PIECE, POINT, make_friction_table

import patchfem as pf
from patchfem.campaigns import fit_patch
from patchfem.campaigns.fits.patch_laws import LawProblem, LoopCurves
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
        ("bouc-wen", {"stiffness": 4e6, "exponent": 1.7, "shape": 0.8}),
        ("elastic-plastic", {"bond_length": 7e-6}),
    ],
)
def test_exact_parameters_of_each_law_are_recovered_from_its_loops(law, keys):
    """The parameters of a law are recovered from its own steady loops within 1e-6."""
    true_law = Friction.model_construct(law=law, static=0.3, **keys)
    amplitudes = np.geomspace(2e-7, 6e-5, 20)
    target = LoopCurves(*steady_loop(true_law, 100.0, amplitudes))
    result = LawProblem(law, 0.3, 100.0, amplitudes, target, 5e6).solve()
    assert result.values == pytest.approx(keys, rel=1e-6)
    assert np.abs(result.deviations).max() < 1e-6


def test_mesh_is_refined_until_micro_slip_exponent_is_accurate():
    """The mesh is refined until the micro-slip exponent of a crowned strip is accurate.

    The energy loss grows with the third power of a small amplitude, so chi = 0; a fixed coarse mesh
    gives a warning that names the remedy, and the remedy works.
    """
    pinned = fit_patch(pf.load(JOINT + SLIDE))
    assert "energy loss has an error" in pinned.warnings[0]
    assert "leave contact.element_size out" in pinned.warnings[0]
    result = fit_patch(pf.load(JOINT.replace('element_size = "0.2 mm"\n', "") + SLIDE))
    assert result.laws["iwan"].values["chi"] > -0.02 and not result.warnings
    assert result.patch.nodes > 2 * pinned.patch.nodes
    assert np.sqrt(np.mean(result.patch.mesh_change[1] ** 2)) < 0.1


def test_exact_rough_wedge_is_fitted_by_an_iwan_law():
    """A wedge on a soft elastic layer is an Iwan joint: chi = 0, beta = 0, K = k_t A within 1e-3.

    The pressure falls linearly to zero, so that the yield displacements of the nodes are uniformly
    distributed.
    """
    result = fit_patch(pf.load(WINKLER), np.geomspace(5e-8, 1e-6, 12))
    iwan = result.laws["iwan"]
    assert iwan.values["chi"] == 0.0 and iwan.values["beta"] == pytest.approx(0.0, abs=2e-2)
    assert iwan.values["stiffness"] == pytest.approx(0.8e12 * 12.7e-3**2, rel=1e-3)
    assert np.abs(iwan.deviations).max() < 2e-3 and result.best == "iwan"


def test_rig_with_fitted_law_has_backbone_of_the_patch(tmp_path):
    """The patch and each fitted law give the rig the same frequency and damping.

    The differences are at most those that the fit states.
    """
    answer = pf.fit(RIG, from_patch=True, out=tmp_path / "out")
    slides = np.geomspace(*answer["amplitudes"], answer["rows"])
    method = {"method": "quasi-static", "amplitudes": slides}
    patch = pf.backbone(RIG, **method)
    for law, fit in answer["laws"].items():
        point = pf.backbone(tmp_path / f"out/scene.{law}.toml", **method)
        f, zeta = (
            point[f"quasi_static_{name}"].values / patch[f"quasi_static_{name}"].values - 1
            for name in ("frequency", "damping")
        )
        stiffness, loss = (abs(fit[part]["largest"]) for part in ("stiffness", "dissipation"))
        assert np.abs(f).max() <= 1 - np.sqrt(1 - stiffness)
        assert np.abs(zeta).max() <= (1 + loss) / (1 - stiffness) - 1
        # The stiffness of the contact has a large effect on the frequency of the mode.
        assert np.abs(f).max() > 0.2 * stiffness
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
def test_exact_slip_force_is_friction_coefficient_times_load(table):
    """The slip force of a patch and of each fitted law is mu N, also with strips or a holder."""
    result = fit_patch(
        pf.load(RIG.replace("[contact.shear]\n", "[contact.shear]\n" + table)), [1e-8, 1e-6, 1e-4]
    )
    assert result.patch.slip_force == pytest.approx(0.3 * result.patch.load, rel=1e-9)
    assert all(
        one.curves.force[-1] == pytest.approx(result.patch.slip_force, rel=1e-6)
        for one in result.laws.values()
    )


@pytest.mark.parametrize(
    "text, message",
    [
        (POINT + make_friction_table("iwan") + SLIDE, "[contact]"),
        (CROWN, "[friction]"),
        (
            JOINT.replace('"coulomb"', '"nonlocal"\nbond_length = "1 um"') + SLIDE,
            "use law coulomb or elastic-plastic",
        ),
        (JOINT.replace("[contact.shear]\n", "") + SLIDE, "add [contact.shear]"),
        (
            RIG.replace("slide = 1.0", "slide = 1.0\nnormal = 0.1").replace(
                '"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'
            ),
            "`normal`, `pitch` and `yaw` to 0",
        ),
        (
            JOINT + SLIDE + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 10\n',
            "leave [wear] out",
        ),
        (JOINT.replace('load = "26 lbf"', 'load = "0 N"') + SLIDE, "the normal load is 0"),
    ],
)
def test_refuses_unsuitable_patch_and_names_remedy(text, message):
    """A scene whose patch has no single-point law is refused with the remedy."""
    with pytest.raises(pf.PatchfemError) as error:
        fit_patch(pf.load(text))
    assert message in str(error.value)


def test_refuses_incompatible_options_of_fit():
    """Options that exclude each other, and ranges of amplitudes that are too short, are refused."""
    for given, message in (
        ({}, "from_patch alone"),
        ({"from_patch": True, "to": "a.csv"}, "from_patch alone"),
        ({"from_patch": True, "amplitudes": "1 um,2 um"}, "at least three"),
        ({"from_patch": True, "amplitudes": "1 s..2 s:4"}, "amplitudes"),
        ({"amplitudes": "1 um..2 um:4"}, "applies only to"),
        ({"from_patch": True, "hold": "a=1"}, "hold"),
    ):
        with pytest.raises(pf.PatchfemError, match=message):
            pf.fit(JOINT + SLIDE, **given)
