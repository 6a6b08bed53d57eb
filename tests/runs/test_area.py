"""Scenes with [contact.area]: static faces, benches, rigs, wear, scans and files of fields."""

import json

import numpy as np
import pytest

import patchfem as pf
from patchfem.export import run_folder
from patchfem.export.charts import panels
from patchfem.export.rows import CHARTS
from patchfem.export.runs import make_run_answer
from patchfem.model.face import average_over_cells
from patchfem.surface.areal import Areal

LOAD = 26 * 4.4482216152605  # N
BLOCK = {
    "length": "12.7 mm",
    "width": "12.7 mm",
    "height": "6.35 mm",
    "load": "26 lbf",
    "substrate": "Ti-8Al-1Mo-1V",
    "coating": {"material": "WC-Co", "thickness": "6 mil"},
    "area": {"cells": 64},
}
COULOMB = {"law": "coulomb", "static": 0.3}
ELASTIC_PLASTIC = {"law": "elastic-plastic", "static": 0.3, "stiffness": "2e8 N/m"}
SLIDE = {"kind": "triangle", "amplitude": "0.2 um", "speed": "10 um/s", "cycles": 2}
MODES = [
    {"name": "axial", "frequency": "143 Hz", "damping": 0.003, "slide": 1.0},
    {"name": "yaw", "frequency": "129 Hz", "damping": 0.003, "slide": 0.095},
]
RIG = {
    "structure": {"moving_mass": "0.884 kg", "mode": MODES},
    "drive": {"kind": "base", "frequency": "143 Hz", "acceleration": "5 g", "cycles": 120},
    "accuracy": {"tolerance": 1e-2, "steps_per_cycle": 400},
}


def run_block(contact=(), **tables):
    """Return the result of a run of the block with other keys of [contact] and more tables."""
    return pf.run({"contact": BLOCK | dict(contact)} | tables)


def tilt(angle: float, roll: float) -> dict:
    """Return the table of a tilt with both angles [mrad]."""
    return {"tilt": {"angle": f"{angle} mrad", "roll": f"{roll} mrad"}}


@pytest.fixture(scope="module")
def rolled():
    """Block with a roll of 0.1 mrad."""
    return run_block(tilt(0, 0.1))


def test_pressure_of_roll_is_that_of_tilt_turned(rolled):
    """A roll presses as a tilt does, turned by 90 degrees; shear has a direction, so that its stiffness differs."""
    tilted = run_block(tilt(0.1, 0))
    pressure = tilted.patch.pressed.pressure
    assert np.allclose(rolled.patch.pressed.pressure, pressure.T, atol=1e-9 * pressure.max())
    stiffness = [one.measures["tangential_stiffness"].value for one in (rolled, tilted)]
    assert stiffness == pytest.approx([188e6, 228e6], rel=0.015)
    fraction = rolled.measures["contact_fraction"]
    assert fraction.value == pytest.approx(0.227, abs=fraction.error)
    assert rolled.measures["pressure_centre_y"].value == pytest.approx(-5.28e-3, rel=1e-2)


def test_always_flat_block_is_softer_than_plane_strain():
    """The stiffnesses of flat blocks are those of bricks alone, 1687 and 402 N/um; plane strain has 1849 and 404."""
    measures = run_block().measures
    assert measures["normal_stiffness"].value == pytest.approx(1687e6, rel=0.01)
    assert measures["tangential_stiffness"].value == pytest.approx(402e6, rel=0.015)
    assert measures["pressure_peak"].value is None
    assert "free side" in measures["pressure_peak"].reason
    assert measures["contact_half_width"].value is None


@pytest.mark.parametrize("cells, is_coated", [(64, True), (256, True), (64, False)])
def test_always_peak_that_may_lie_at_a_coated_side_has_no_value(cells, is_coated):
    """A crown presses most in the middle; cells longer than a stiff coating hide the larger pressure at the sides."""
    contact = {
        "length": "6.3706 mm",
        "width": "3.5965 mm",
        "height": "1.2678 mm",
        "load": "17.682 N",
        "substrate": "aluminium",
        "coating": {"material": "WC-Co", "thickness": "20.51 um"},
        "crown": {"radius": "48.32 m"},
        "tilt": {"angle": "8.402e-06 rad"},
        "area": {"cells": cells},
    }
    if not is_coated:
        del contact["coating"]
    peak = pf.run({"contact": contact}).measures["pressure_peak"]
    assert (peak.value is None) == is_coated
    if is_coated:
        assert "free side" in peak.reason


@pytest.mark.long
@pytest.mark.parametrize(
    "law, work",
    [(COULOMB, 2.460e-3), ({"law": "nonlocal", "static": 0.3, "bond_length": "1 um"}, 1.890e-3)],
)
def test_always_rig_with_both_tilts_dissipates_reference_work(law, work):
    """The work of a cycle of the rig with both tilts is that of an independent areal computation."""
    result = run_block(tilt(0.1, 0.1) | {"shear": {}}, friction=law, **RIG)
    assert result.measures["loop_area"].value == pytest.approx(work, rel=5e-3)


def test_exact_pairs_share_the_load(rolled):
    """Two equal pairs under twice the load have the same pressure and twice the stiffness and friction."""
    motion = {"friction": COULOMB, "slide": SLIDE}
    one = run_block(tilt(0, 0.1) | {"shear": {}}, **motion)
    two = run_block(tilt(0, 0.1) | {"shear": {}, "pairs": 2, "load": "52 lbf"}, **motion)
    for name in ("normal_stiffness", "loop_area", "friction_force_peak", "contact_area"):
        value = one.measures[name].value
        assert two.measures[name].value == pytest.approx(2 * value, rel=1e-9)
    assert two.measures["stick_area_fraction"].value == one.measures["stick_area_fraction"].value


LINEAR_LAYER = {
    "asperities": {"law": "linear", "normal_stiffness": "1e13 Pa/m", "tangential_ratio": 0.5}
}
HOLDER = {"holder": {"tangential_stiffness": "1e8 N/m"}}


@pytest.mark.parametrize(
    "more, law",
    [
        ({"shear": {}}, COULOMB),
        ({"shear": {}} | HOLDER, COULOMB),
        (LINEAR_LAYER, COULOMB),
        (HOLDER, COULOMB),
        ({"shear": {}}, ELASTIC_PLASTIC),
        (HOLDER, ELASTIC_PLASTIC),
    ],
)
def test_exact_frames_carry_the_friction_force(more, law):
    """The shear stress of each frame adds up to the friction force, and no cell exceeds its limit."""
    result = run_block(tilt(0.05, 0.05) | more, friction=law, slide=SLIDE)
    shear = result.fields["shear_stress"]
    sums = shear @ result.patch.pieces.interface.weight
    force = np.interp(result.fields["time"], result.response.time, result.response.force)
    assert sums == pytest.approx(force, abs=4e-4 * 0.3 * LOAD)
    assert (np.abs(shear) <= 0.3 * result.patch.normal_stress * (1 + 1e-6) + 1e-3).all()


def test_exact_hardness_bounds_the_pressure():
    """A hardness bounds the pressure and keeps the load; a share of the face yields."""
    result = run_block(tilt(0.1, 0.1) | {"area": {"cells": 64, "hardness": "5 MPa"}})
    pressure = result.patch.pressed.pressure
    assert pressure.max() == pytest.approx(5e6, rel=1e-12)
    assert result.measures["normal_load"].value == pytest.approx(LOAD, rel=1e-9)
    assert result.measures["yielded_fraction"].value == pytest.approx((pressure >= 5e6).mean())


def test_exact_wear_is_coefficient_times_load_times_path():
    """A face that slips as a whole wears by the coefficient times load times slip path, wherever it is pressed."""
    wear = {"coefficient": "1e-15 m^2/N", "cycles": 1e5}
    slide = SLIDE | {"cycles": 1}
    result = run_block(
        {"crown": {"radius": "20 m", "across": "40 m"}, "area": {"cells": 32}},
        friction=COULOMB,
        slide=slide,
        wear=wear,
        accuracy={"tolerance": 1e-2},
    )
    volume = 1e-15 * LOAD * 4 * 0.2e-6 * 1e5
    assert result.measures["worn_volume"].value == pytest.approx(volume, rel=1e-9)
    variables = make_run_answer(result).data
    assert variables["wear_worn_depth"].dims == ("wear_frame", "y", "x")
    titles = [
        panel.title for panel in panels.make_panels({"": make_run_answer(result)}, CHARTS["bench"])
    ]
    assert {"Worn depth over the face", "Pressure over the face"} <= {*titles}


def test_exact_means_over_cells_keep_the_volume():
    """The means of a scan over cells of any size have the integral of its spline, and constant heights beyond its sides."""
    x = np.linspace(-1.0, 1.0, 21)
    heights = np.cos(2 * x[:, None]) * np.sin(3 * x) + 2
    scan = Areal(x, x, heights, "scan")
    for count in (8, 50):
        cells = ((np.arange(count) + 0.5) / count - 0.5) * 2
        fine = average_over_cells(scan, cells, cells)
        assert fine.mean() == pytest.approx(2.0, abs=1e-12)
    outside = average_over_cells(scan, np.array([-1.3, -1.1]), np.array([1.1, 1.3]))
    assert outside == pytest.approx(np.full((2, 2), heights[-1, 0]), abs=1e-12)


def write_scan(path, shape=(41, 41), size=12.7e-3):
    """Write an areal scan with waves of 3 mm along x and 5 mm along y, and a spike, and return its path."""
    y, x = np.meshgrid(*(np.linspace(0, size, count) for count in shape), indexing="ij")
    heights = 0.2e-6 * (np.cos(2 * np.pi * x / 3e-3) + np.cos(2 * np.pi * y / 5e-3))
    heights[7, 9] += 100e-6
    rows = [
        f"{a * 1e3:.6f},{b * 1e3:.6f},{c * 1e6:.9f}"
        for a, b, c in zip(x.flat, y.flat, heights.flat)
    ]
    path.write_text("x [mm],y [mm],z [um]\n" + "\n".join(rows) + "\n")
    return path


def test_always_scan_touches_at_its_tops(tmp_path):
    """A scan of a surface touches where it is high; its spike is removed with a note, and a small scan is refused."""
    path = write_scan(tmp_path / "scan.csv")
    profile = {"scan": str(path), "heights": "surface"}
    result = run_block({"profile": profile})
    pressure = result.patch.pressed.pressure
    row, column = np.unravel_index(pressure.argmax(), pressure.shape)
    normal = result.patch.pieces.normal
    phase = (normal.x[column] + 6.35e-3) / 3e-3
    assert abs(phase - round(phase)) < 0.1
    assert abs((normal.y[row] + 6.35e-3) / 5e-3 % 1 - 0.5) > 0.4
    assert any("spikes were removed" in note for note in result.notes)
    with pytest.raises(pf.PatchfemError, match=r"profile\.scan.*covers"):
        run_block({"profile": profile, "width": "40 mm"})


def test_exact_files_hold_the_face(tmp_path, rolled):
    """An independent reader finds the load in fields.vtkhdf; netCDF has y and x; the page has maps and the cut."""
    pv = pytest.importorskip("pyvista")
    result = run_block(tilt(0, 0.1) | {"shear": {}}, friction=COULOMB, slide=SLIDE)
    answer = run_folder.save_run(result, tmp_path / "out")
    face = pv.read(tmp_path / "out" / "fields.vtkhdf")["interface"]
    sizes = face.compute_cell_sizes()["Area"]
    assert face.n_cells == 64**2 and sizes == pytest.approx((12.7e-3 / 64) ** 2, rel=1e-5)
    forces = face.cell_data["normal_stress"] * face.cell_data["weight"]
    assert forces.sum() == pytest.approx(LOAD, rel=1e-9)
    assert face.cell_centers().points[:, 1] @ forces < -4e-3 * LOAD
    grids = result.to_pyvista()
    assert np.array_equal(grids["interface"]["normal_stress"], result.patch.normal_stress)

    # The frames of the file in the other formats
    folder = tmp_path / "out"
    for name in ("face.vtu", "face.pvd", "face.vtkhdf", "face.csv"):
        pf.export(folder, folder / name)
    assert pv.read(folder / "face.vtu").n_cells == 64**2
    table = np.genfromtxt(folder / "face.csv", delimiter=",", names=True)
    assert table["normal_stress_Pa"].sum() == pytest.approx(LOAD / (12.7e-3 / 64) ** 2, rel=1e-6)
    pf.view(folder, folder / "face.png")
    assert (folder / "face.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(pf.PatchfemError, match="picture of one frame"):
        pf.view(folder, folder / "face.gif")
    assert answer.data["normal_stress"].dims == ("frame", "y", "x")
    assert answer.data["reversal_status"].values.shape == (64, 64)
    shown = panels.make_panels({"": answer}, CHARTS["bench"])
    titles = {panel.title for panel in shown}
    assert "Open, stick and slip over the face" in titles
    assert "Gap, cut at y = 0" in titles
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "contact_area" in summary["measures"]


def test_exact_interface_with_a_face_is_the_rig_with_contact():
    """A mass on a spring whose interface has a face moves as the mode with the same [contact]."""
    contact = BLOCK | tilt(0.05, 0.05) | {"shear": {}, "load": "100 N"}
    stiffness = float(0.5 * (2 * np.pi * 140) ** 2)
    drive = {"kind": "base", "frequency": "150 Hz", "acceleration": "30 g", "cycles": 10}
    interface = {"between": [1, 0], "contact": contact} | COULOMB
    damping = float(2 * 0.003 * np.sqrt(stiffness * 0.5))
    masses = {
        "masses": ["0.5 kg"],
        "spring": [{"between": [1, 0], "stiffness": f"{stiffness!r} N/m"}],
        "damper": [{"between": [1, 0], "coefficient": f"{damping!r} N s/m"}],
        "interface": [interface],
    }
    mode = {"name": "a", "frequency": "140 Hz", "damping": 0.003, "slide": 1.0}
    one = pf.run({"structure": masses, "drive": drive})
    other = pf.run(
        {
            "contact": contact,
            "friction": COULOMB,
            "structure": {"moving_mass": "0.5 kg", "mode": [mode]},
            "drive": drive,
        }
    )
    for name in ("loop_area", "tangential_stiffness"):
        assert one.measures[name].value == pytest.approx(other.measures[name].value, rel=1e-6)
