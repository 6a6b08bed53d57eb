"""Universal files written by pyuff and read back: shapes with their scale, responses with their modes."""

import numpy as np
import pytest
import pyuff

from patchfem.core import PatchfemError
from patchfem.structure import compute_receptance, masses, places, universal

SIX = 2e-5  # dataset 55 and the frequencies of 58 have six digits
RIG = masses.build_basis(
    [1.0, 2.0, 0.5], [((1, 0), 4e5), ((2, 1), 3e5), ((3, 2), 2e5)], [], [(3, 0)], 1
)
ZETA = np.array([0.01, 0.02, 0.005])
NODES = [11, 12, 13]


def damped():
    return type(RIG)(
        RIG.names, RIG.omega, ZETA, RIG.slide, RIG.base, RIG.output, 1.0, shapes=RIG.shapes
    )


def write(path, sets):
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
    return path


def normal_modes(masses_of=(1.0, 4.0, 0.25), **change):
    """Dataset 55 of the rig along y, each shape with its own scale and modal mass."""
    sets = []
    for k, m in enumerate(masses_of):
        still = np.zeros(3)
        sets.append(
            {
                "type": 55,
                "analysis_type": 2,
                "data_ch": 2,
                "spec_data_type": 8,
                "load_case": 1,
                "mode_n": k + 1,
                "node_nums": NODES,
                "r1": still,
                "r2": RIG.shapes[:, k] * np.sqrt(m),
                "r3": still,
                "modal_m": m,
                "freq": RIG.omega[k] / 2 / np.pi,
                "modal_damp_vis": ZETA[k],
                "modal_damp_his": 0.0,
                **change,
            }
        )
    return sets


def complex_modes(scales=(1.0, 2j, 0.8 + 0.6j)):
    """Complex modes of the same rig: v = c phi, modal A = c^2 2i w_d, and a poor phase on one entry."""
    sets = []
    for k, c in enumerate(scales):
        damped_omega = RIG.omega[k] * np.sqrt(1 - ZETA[k] ** 2)
        shape = complex(c) * RIG.shapes[:, k]
        sets.append(
            {
                "type": 55,
                "analysis_type": 3,
                "data_ch": 2,
                "spec_data_type": 8,
                "load_case": 1,
                "mode_n": k + 1,
                "node_nums": NODES,
                "r1": 0 * shape,
                "r2": shape + 0j,
                "r3": 0 * shape,
                "eig": complex(-ZETA[k] * RIG.omega[k], damped_omega),
                "modal_a": c**2 * 2j * damped_omega,
                "modal_b": 0j,
            }
        )
    return sets


def responses(kind=12, noise=0.0, sign=(1, 1, 1), every=0.5, **change):
    f = np.arange(20.0, 250.0, every)
    w = 2 * np.pi * f
    H = (
        compute_receptance(damped(), w, RIG.shapes, RIG.shapes[2])[:, :, 0]
        * ((1j * w) ** {8: 0, 11: 1, 12: 2}[kind])[:, None]
    )
    rng = np.random.default_rng(5)
    H = H * (1 + noise * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2))
    return [
        {
            "type": 58,
            "func_type": 4,
            "rsp_node": NODES[k],
            "rsp_dir": 2 * sign[k],
            "ref_node": 13,
            "ref_dir": 2,
            "abscissa_spacing": 1,
            "abscissa_spec_data_type": 18,
            "ordinate_spec_data_type": kind,
            "orddenom_spec_data_type": 13,
            "x": f,
            "data": H[:, k] * sign[k],
            **change,
        }
        for k in range(3)
    ]


def check(found, rtol, shape_tol):
    np.testing.assert_allclose(2 * np.pi * found.frequency, RIG.omega, rtol=rtol)
    got = np.stack([found.motion[node, 1] for node in NODES])
    want = RIG.shapes * np.sign(RIG.shapes[0] * got[0])
    np.testing.assert_allclose(got, want, atol=shape_tol)


def test_exact_normal_modes(tmp_path):
    found = universal.read_universal(write(tmp_path / "a.uff", normal_modes()))
    check(found, SIX, SIX)
    np.testing.assert_allclose(found.zeta, ZETA, rtol=SIX)
    assert not found.notes


def test_exact_complex_modes_are_turned_and_said(tmp_path):
    found = universal.read_universal(write(tmp_path / "a.uff", complex_modes()))
    check(found, SIX, SIX)
    np.testing.assert_allclose(found.zeta, ZETA, rtol=1e-4)
    assert len(found.notes) == 3 and "mode 1 is complex" in found.notes[0]
    sets = complex_modes()
    sets[1]["r2"] = sets[1]["r2"] * np.array([1, np.exp(0.1j), 1])
    assert "leaves out" in universal.read_universal(write(tmp_path / "b.uff", sets)).notes[1]


def test_exact_units_of_dataset_164(tmp_path):
    """In mm and mN (kg as mass unit: mN s^2/mm): shapes per sqrt(kg) stay; responses in mm/mN are m/N."""
    units = {
        "type": 164,
        "units_code": 5,
        "units_description": "mm",
        "temp_mode": 1,
        "length": 1000.0,
        "force": 1000.0,
        "temp": 1.0,
        "temp_offset": 0.0,
    }
    check(universal.read_universal(write(tmp_path / "a.uff", [units, *normal_modes()])), SIX, SIX)
    # mass unit lbf s^2/in = 175.1268 kg
    inches = units | {
        "length": 39.37007874,
        "force": 0.2248089431,
    }
    found = universal.read_universal(write(tmp_path / "b.uff", [inches, *normal_modes()]))
    np.testing.assert_allclose(
        np.abs(found.motion[11, 1]), np.abs(RIG.shapes[0]) / np.sqrt(175.126835), rtol=SIX
    )
    found = universal.read_universal(write(tmp_path / "c.uff", [inches, *responses(8)]))
    np.testing.assert_allclose(
        np.abs(found.motion[11, 1]), np.abs(RIG.shapes[0]) / np.sqrt(175.126835), rtol=1e-5
    )


@pytest.mark.parametrize("kind", [8, 11, 12])
def test_exact_modes_from_written_responses(tmp_path, kind):
    """Receptance, mobility and accelerance with a turned accelerometer give the modes back to 1e-6."""
    found = universal.read_universal(write(tmp_path / "a.uff", responses(kind, sign=(1, -1, 1))))
    check(found, 1e-6, 1e-6)
    np.testing.assert_allclose(found.zeta, ZETA, rtol=1e-6)
    assert not found.notes


def test_exact_accelerometer_in_g(tmp_path):
    sets = responses(12, ordinate_axis_units_lab="g")
    for one in sets:
        one["data"] = one["data"] / 9.80665
    check(universal.read_universal(write(tmp_path / "a.uff", sets)), 1e-6, 1e-6)
    odd = universal.read_universal(
        write(tmp_path / "b.uff", responses(12, ordinate_axis_units_lab="furlong"))
    )
    assert any("'furlong' is not known" in note for note in odd.notes)


def test_exact_places_give_the_basis(tmp_path):
    """Scaled to a moving mass of 2 kg at node 12: slide of 13 against 11, base by the share of the block."""
    shapes = universal.read_universal(write(tmp_path / "a.uff", normal_modes()))
    found = places.build_basis(
        shapes,
        2.0,
        {"slide_at": "13:+y, 11:-y", "output_at": "12:y", "base_at": "12:+y"},
        is_forced=False,
    )
    sign = np.sign(RIG.shapes[1])
    np.testing.assert_allclose(
        found.slide, np.sqrt(2) * (RIG.shapes[2] - RIG.shapes[0]) * sign, atol=2 * SIX
    )
    np.testing.assert_allclose(found.output, np.sqrt(2) * RIG.shapes[1] * sign, atol=2 * SIX)
    np.testing.assert_allclose(found.base, found.output, rtol=0, atol=0)
    assert np.sum(found.base**2) == pytest.approx(1, abs=1e-4), (
        "node 12 carries 2 kg: the modes contain all of it"
    )
    forced = places.build_basis(
        shapes, 2.0, {"slide_at": "13:+y", "force_at": "11:-y"}, is_forced=True
    )
    np.testing.assert_allclose(
        forced.base * forced.slide, 2 * RIG.shapes[0] * RIG.shapes[2], atol=3 * SIX
    )
    # the modes answer a force as the rig itself does
    w = np.array([300.0, 700.0])
    ours = compute_receptance(found, w, found.output, found.slide)
    np.testing.assert_allclose(
        ours,
        compute_receptance(damped(), w, RIG.shapes[1], RIG.shapes[2] - RIG.shapes[0]),
        rtol=1e-3,
    )
    assert not places.note_missing_mass(found)
    assert (
        "contain"
        in places.note_missing_mass(
            places.build_basis(shapes, 0.5, {"slide_at": "12:+y"}, is_forced=False)
        )[0]
    )


@pytest.mark.parametrize("where, says", [
    ({"slide_at": "99:+y"}, "structure.slide_at: the file has no motion of 99:y; the file has 11:x, 11:y, 11:z"),
    ({"slide_at": "twelve"}, "structure.slide_at: 'twelve' is not a node with a direction; write node:direction"),
    ({"slide_at": "12:+x"}, "structure.slide_at: no mode of the file moves '12:+x'"),
    ({"slide_at": "12:+y", "output_at": "11:+z"}, "structure.output_at: no mode of the file moves"),
    ({"slide_at": "12:+ry"}, "structure.slide_at: the file has no motion of 12:ry"),
    ({"slide_at": "12:+y", "base_at": "13:y"}, "structure.base_at: at this place the modes contain 4 times "
                                               "structure.moving_mass"),
])  # fmt: skip
def test_refuses_places_that_are_not_there(tmp_path, where, says):
    shapes = universal.read_universal(write(tmp_path / "a.uff", normal_modes()))
    with pytest.raises(PatchfemError) as caught:
        places.build_basis(shapes, 2.0, where, is_forced=False)
    assert says in str(caught.value)


@pytest.mark.parametrize("sets, says", [
    (normal_modes((1.0, 0.0, 1.0)), "mode 2 ("), (normal_modes(modal_m=0.0), "has no modal mass"),
    (normal_modes(modal_damp_vis=-0.01), "both must be >= 0"),
    (responses(12, orddenom_spec_data_type=12), "is a response of type 12 per input of type 12; displacement (8)"),
    (responses(8, func_type=1), "dataset 58 contains no frequency response function"),
    (responses(12, ref_node=99), "a response at the driven point itself (99:y)"),
    (responses(12)[:2] + responses(12, every=0.25)[2:], "is given at other frequencies than the first"),
    ([{"type": 164, "units_code": 1, "units_description": "SI", "temp_mode": 1, "length": 1.0, "force": 1.0,
       "temp": 1.0, "temp_offset": 0.0}], "has neither mode shapes (dataset 55"),
])  # fmt: skip
def test_refuses_files_without_what_is_needed(tmp_path, sets, says):
    with pytest.raises(PatchfemError) as caught:
        universal.read_universal(write(tmp_path / "a.uff", sets))
    assert says in str(caught.value)


@pytest.mark.parametrize(
    "content", [b"", b"no universal file\n", b"    -1\n    55\nbroken\n    -1\n"]
)
def test_refuses_what_is_no_universal_file(tmp_path, content):
    (tmp_path / "a.uff").write_bytes(content)
    with pytest.raises(PatchfemError, match=r"cannot be read|no dataset 55"):
        universal.read_universal(tmp_path / "a.uff")
