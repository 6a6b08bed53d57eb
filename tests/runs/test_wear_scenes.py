"""Scenes with [wear]: volumes in closed form, the patch after wear, shakedown, what is refused and what is written."""

import io
import json
import re

import h5py
import numpy as np
import pytest
import wear_scenes
import xarray as xr
from command_line import cli
from pieces import bare, refined_middle
from scene_texts import COATED, COULOMB, MODE, NONLOCAL, POINT, SHEAR, STRUCTURE, mistakes, only
from scipy.optimize import brentq

import patchfem as pf
from patchfem import build
from patchfem.closed_forms.contact import hertz_half_width, hertz_peak
from patchfem.contact.unilateral import solve_forces
from patchfem.core import Compliance, Interface
from patchfem.elasticity import interface_compliance, make_piece
from patchfem.runs.patch.result import solve_with_coarser
from patchfem.runs.wear import evolve
from patchfem.scene import loads
from patchfem.slip import jenkins_set
from patchfem.wear import WearProblem, start_wear, take_jump

TILTED = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n'
SINE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
WEAR = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 135723\n'
LOAD, KAPPA, CYCLES = 26 * 4.4482216152605, 1e-14, 135723
SOFT_RIG = (
    TILTED
    + SHEAR
    + NONLOCAL
    + MODE
    + '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 100\n'
)
LONG = WEAR.replace("135723", "1e9").replace("1e-14", "1e-13")
THIN_COAT = TILTED + COULOMB + SINE + LONG  # the coating is gone before the last of its cycles
WORN_CROWN = """[contact]
length = "6 mm"
width = "8 mm"
height = "5 mm"
load = "800 N"
substrate = "Ti-8Al-1Mo-1V"
[contact.upper]
coating = {{material = "WC-Co", thickness = "60 um"}}
[contact.crown]
radius = "200 mm"
[accuracy]
tolerance = {tolerance}
[slide]
kind = "sine"
amplitude = "40 um"
frequency = "10 Hz"
cycles = 3
[wear]
coefficient = "1e-14 m^2/N"
cycles = 100000
[friction]
law = "coulomb"
static = 0.6
"""
LOOSE = "[accuracy]\ntolerance = 2e-2\n"


def ran(text, **sets):
    return pf.run(loads(text, "wear.toml"), **sets)


def test_exact_bench_volume_is_coefficient_load_path():
    found = ran(TILTED + COULOMB + SINE + WEAR)
    volume = found.measures["worn_volume"]
    assert volume.value == pytest.approx(KAPPA * LOAD * 40e-6 * CYCLES, rel=1e-12)
    assert 0 < volume.error <= 1e-3 * volume.value
    new = ran(TILTED + COULOMB + SINE)
    assert found.measures["contact_fraction"].value > 1.4 * new.measures["contact_fraction"].value
    assert found.measures["pressure_peak"].value < 0.6 * new.measures["pressure_peak"].value
    assert found.measures["loop_area"].value == pytest.approx(
        new.measures["loop_area"].value, rel=1e-12
    )


@pytest.mark.parametrize("motion", [SINE, STRUCTURE], ids=["bench", "rig"])
def test_exact_one_point_wears_by_its_load_and_path(motion):
    found = ran(POINT + COULOMB + motion + WEAR)
    amplitude = found.measures["slip_amplitude"].value
    assert found.measures["worn_volume"].value == pytest.approx(
        KAPPA * LOAD * 4 * amplitude * CYCLES, rel=2e-3
    )
    assert "worn_depth_max" not in found.measures


def test_exact_energy_form_is_archard_with_coefficient_times_friction():
    one = ran(TILTED + COULOMB + SINE + WEAR)
    two = ran(
        TILTED + COULOMB + SINE + WEAR.replace("1e-14", repr(KAPPA / 0.3)) + 'form = "energy"\n'
    )
    for name in ("worn_volume", "worn_depth_max", "pressure_peak"):
        assert two.measures[name].value == pytest.approx(one.measures[name].value, rel=1e-9)


@pytest.mark.share(0, 2, 3, 4)
@pytest.mark.parametrize(
    "beside",
    [
        '[contact.asperities]\nlaw = "exponential"\nnormal_stiffness = "1e13 Pa/m"\ndecay_length = "2.5 um"\n',
        '[contact.asperities]\nlaw = "hertz"\nradius = "10 um"\ndensity = "1e10 1/m^2"\nheight_deviation = "0.5 um"\n',
        '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e13 Pa/m"\n',
        '[contact.holder]\nrotational_stiffness = "1e4 N m/rad"\n',
        '[contact.crown]\nradius = "1 m"\n',
    ],
    ids=["exponential", "hertz", "linear", "holder", "crown"],
)
def test_exact_every_skin_and_shape_wears_by_its_load(beside):
    found = ran(TILTED + beside + COULOMB + SINE + WEAR)
    assert found.measures["worn_volume"].value == pytest.approx(
        KAPPA * LOAD * 40e-6 * CYCLES, rel=1e-12
    )


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "slide, path",
    [
        ('kind = "constant"\nspeed = "5 mm/s"\ndistance = "50 um"', 50e-6),
        (
            'kind = "dwell"\nspeed = "5 mm/s"\ndistance = "50 um"\nhold = "0.1 s"\ndistance_after = "20 um"',
            70e-6,
        ),
        (
            'kind = "triangle"\nspeed = "5 mm/s"\namplitude = "3 um"\ndistance = "2 um"\ncycles = 3',
            12e-6,
        ),
    ],
    ids=["constant", "dwell", "triangle"],
)
def test_exact_a_slide_that_does_not_repeat_is_one_cycle(slide, path):
    for contact in (TILTED, TILTED + SHEAR):
        found = ran(contact + COULOMB + f"[slide]\n{slide}\n" + WEAR).measures["worn_volume"]
        assert found.value == pytest.approx(
            KAPPA * LOAD * path * CYCLES, rel=1e-12 if contact == TILTED else 0.06
        )


@pytest.fixture(scope="module")
def worn_folder(tmp_path_factory):
    """The results folder of a worn bench."""
    scene = tmp_path_factory.mktemp("worn") / "worn.toml"
    scene.write_text(TILTED + COULOMB + SINE + WEAR)
    answer = cli("run", scene, "-o", scene.parent / "out", "-q")
    assert answer.code == 0, answer.err
    return scene.parent / "out"


def test_exact_files_hold_the_history_of_the_wear(worn_folder):
    with xr.open_dataset(worn_folder / "result.nc", engine="h5netcdf") as data:
        load = (data.weight * data.normal_stress).sum("x")
        assert load.values == pytest.approx(LOAD, rel=1e-10)
        depth = data.worn_depth.values
        assert (np.diff(depth, axis=0) >= -1e-20).all()
        assert not depth[0].any()
        assert depth[-1].max() > 0
        volume = data.wear_worn_volume.values
        assert volume == pytest.approx(KAPPA * LOAD * 40e-6 * data.wear_cycle.values, rel=1e-12)
        assert data.wear_cycle.values[[0, -1]].tolist() == [0.0, CYCLES]
        assert (np.diff(data.frame_time.values) > 0).all()


def test_exact_bodies_close_over_the_worn_gap_in_every_frame(worn_folder):
    """The distance of both interfaces changes from frame to frame as the remaining gap less the worn depth."""
    with (
        h5py.File(worn_folder / "fields.vtkhdf") as file,
        xr.open_dataset(worn_folder / "result.nc", engine="h5netcdf") as data,
    ):
        frames, nodes = data.gap.shape
        sides = []
        for body in (file["VTKHDF/lower"], file["VTKHDF/upper"]):
            points = body["Points"][:]
            flat = np.flatnonzero(np.abs(points[:, 1]) < 1e-12)
            assert flat.size == nodes
            sides.append(
                body["PointData/displacement"][:].reshape(frames, len(points), 3)[:, flat, 1]
            )
        apart = sides[1] - sides[0]
        expected = data.gap.values - data.worn_depth.values
        change = np.ptp(expected, axis=0).max()
        assert np.abs((apart - apart[0]) - (expected - expected[0])).max() < 1e-5 * change


@pytest.mark.slow
def test_exact_shakedown_of_a_crown_under_a_tangential_force():
    """Cattaneo-Mindlin with Q = 0.6 mu P: the stick zone c = a0 sqrt(0.4) stays, all pressure moves into it, and its
    middle tends to c/a0 + 0.6 P/(pi c p0) of the Hertz peak: Hertz under 0.4 P and a flat punch under the rest.
    Normal and tangential compliance are alike, as of two half-planes (Ciavarella and Hills, 1999)."""
    width = 10e-3
    radius = 0.05
    line = 1e5
    mu = 0.5
    young = 121e9
    cells = 24
    half = hertz_half_width(line, radius, young / (1 - 0.32**2) / 2)
    peak = hertz_peak(line, radius, young / (1 - 0.32**2) / 2)
    stick = half * np.sqrt(0.4)
    grid = refined_middle(1.5 * half, half / cells, 40 * half, 20 * half, 1.15)
    nn, _, _ = interface_compliance(
        make_piece(grid.x, grid.depth, grid.coating_rows, bare((young, 0.32)))
    )
    x = grid.x
    area = grid.tributary_lengths() * width
    gap = grid.x**2 / 2 / radius
    load = line * width
    pair = Compliance(Interface(x, area, width), 2 * nn / width, 2 * nn / width)

    def press(worn, softening):
        return solve_forces(pair.normal + np.diag(softening), x, gap + worn, np.array([load]))[0]

    def path(worn):
        limit = mu * solve_forces(pair.normal, x, gap + worn, np.array([load]))[0]
        group = jenkins_set(pair.tangential, limit)
        slide = brentq(
            lambda q: group.stiffness @ np.minimum(q, group.yield_displacement) - 0.6 * mu * load,
            0.0,
            group.yield_displacement[-1],
            xtol=1e-22,
        )
        shear = np.zeros(x.size)
        shear[group.points] = group.force_matrix @ np.minimum(slide, group.yield_displacement)
        slips = (limit > 0) & (shear > limit * (1 - 1e-9))
        return np.where(slips, 4 * np.abs(slide - pair.tangential @ shear), 0.0)

    asked = WearProblem(press, path, area, 1e-13, 1e9)
    state = start_wear(asked)
    count = 0
    at_first = state.path @ state.force
    while state.cycle < asked.cycles:
        state = take_jump(asked, state, 1e-2)
        count = count + 1
    inside = np.abs(x) < stick
    assert count < 60
    assert (state.path[inside] == 0).all() and not state.depth[inside].any()
    assert state.force[inside].sum() == pytest.approx(load, rel=1e-9)
    assert state.path @ state.force < 1e-9 * at_first
    found = (state.force / area)[np.argmin(np.abs(x))] / peak
    assert found == pytest.approx(stick / half + 0.6 * line / (np.pi * stick * peak), abs=2e-3)


def test_exact_the_tolerance_of_a_warning_leads_to_a_finer_mesh_under_wear():
    """The patch before wear chooses the mesh; by the worn one the warning named a tolerance that led to the same."""
    text = WORN_CROWN.format(tolerance=1e-2)
    found = ran(text)
    told = [one for one in found.warnings if "finer mesh" in one]
    nodes, tolerance = re.search(
        r"\((\d+) interface nodes\).*accuracy\.tolerance = (\S+) for", told[0]
    ).groups()
    assert int(nodes) == found.patch.x.size
    asked = build(loads(WORN_CROWN.format(tolerance=tolerance), "s.toml")).patch
    assert solve_with_coarser(asked, float(tolerance))[0].x.size > int(nodes)


def test_refuses_what_wear_does_not_go_with():
    assert any("wear" in line for line in mistakes(TILTED + WEAR))
    free = (
        POINT
        + COULOMB
        + MODE
        + '[drive]\nkind = "free"\ndisplacement = "1 mm"\ncycles = 5\n'
        + WEAR
    )
    assert "steady motion" in only(free)


def test_always_a_motion_without_bounds_wears_nothing():
    for contact, outcome in ((TILTED, "leaves_contact"), (POINT, "grows")):
        found = ran(
            contact
            + COULOMB
            + MODE.replace("0.003", "0.0")
            + '[drive]\nkind = "base"\nfrequency = "143 Hz"\n'
            'acceleration = "9 g"\ncycles = 100\n' + WEAR
        )
        assert found.outcome == outcome and "worn_volume" not in found.measures
        assert any("nothing was worn" in line for line in found.warnings)


@pytest.mark.share(0, 1, 4)
@pytest.mark.parametrize(
    "text",
    [
        TILTED + COULOMB + SINE + WEAR + "jumps = 3\n",
        SOFT_RIG + WEAR + "jumps = 2\n" + LOOSE,
        TILTED + COULOMB + SINE + WEAR,
        SOFT_RIG + WEAR + LOOSE,
        THIN_COAT + "jumps = 40\n",
    ],
    ids=["bench_jumps", "rig_jumps", "bench", "rig", "worn_through"],
)
def test_exact_a_run_goes_on_from_every_kept_state_to_the_same_bytes(tmp_path, monkeypatch, text):
    """The last state among them, after which no jump is left."""
    scene = tmp_path / "worn.toml"
    states = []
    scene.write_text(text)

    save = evolve.save_state

    def noted(path, *more):
        save(path, *more)
        states.append(path.read_bytes())

    with monkeypatch.context() as patched:
        patched.setattr(evolve, "save_state", noted)
        assert cli("run", scene, "-o", tmp_path / "whole", "-q", "--no-page").code == 0
    assert len(states) >= 2
    for state in states:
        (tmp_path / "out.partial").mkdir()
        (tmp_path / "out.partial" / "wear.npz").write_bytes(state)
        resumed = cli("run", scene, "-o", tmp_path / "out", "--resume", "-q", "--no-page")
        assert resumed.code == 0 and "held the state" not in resumed.err
        for name in ("result.nc", "fields.vtkhdf", "scene.resolved.toml"):
            assert (tmp_path / "out" / name).read_bytes() == (
                tmp_path / "whole" / name
            ).read_bytes(), name
        one, two = (
            json.loads((tmp_path / name / "summary.json").read_text()) for name in ("whole", "out")
        )
        assert {**one, "seconds": 0, "effects": 0} == {**two, "seconds": 0, "effects": 0}


@pytest.mark.share(2)
@pytest.mark.parametrize("more", ["jumps = 3\n", "", "upper_share = 0.2\njumps = 40\n"])
def test_exact_a_coating_worn_through_ends_the_run_at_its_cycle(more):
    """The volume is that of the cycles so far, the depth at the deepest place the coating of the piece that loses
    most."""
    found = ran(THIN_COAT + more)
    cycle = found.measures["worn_through_cycle"]
    coating = 6 * 25.4e-6
    share = 0.8 if "share" in more else 0.5
    assert found.outcome == "worn_through" and 0 < cycle.value < 1e9
    assert found.measures["worn_depth_max"].value * share == pytest.approx(coating, rel=1e-6)
    volume = found.measures["worn_volume"].value
    assert volume == pytest.approx(1e-13 * LOAD * 40e-6 * cycle.value, rel=1e-12)
    assert found.extra["wear"]["cycle"][-1] == cycle.value
    assert (
        any(
            f"lower piece, {152.4:.4g} um, is worn through" in text for text in found.extra["notes"]
        )
        or share == 0.5
    )
    # two coatings of flat pieces that wear evenly: the patch sinks by its volume over its area, and by the tilt
    even = volume / (12.7e-3) ** 2
    assert even < found.measures["worn_depth_max"].value < even + 0.1e-3 * 12.7e-3
    apart = [
        ran(THIN_COAT.replace("1e9", repr(cycle.value + off)) + more)
        for off in (-cycle.error, cycle.error)
    ]
    assert [one.outcome == "worn_through" for one in apart] == [False, True]


def test_refuses_to_resume_the_run_of_another_scene(tmp_path, monkeypatch):
    scene = tmp_path / "worn.toml"
    save = evolve.save_state
    scene.write_text(TILTED + COULOMB + SINE + WEAR)

    def interrupted(*asked):
        save(*asked)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(evolve, "save_state", interrupted)
        answer = cli("run", scene, "-o", tmp_path / "out", "--no-page")
    assert answer.code == 130 and "--resume" in answer.err
    assert [path.name for path in (tmp_path / "out.partial").iterdir()] == ["wear.npz"]
    other = cli(
        "run", scene, "-o", tmp_path / "out", "--resume", "--set", "wear.coefficient=2e-14 m^2/N"
    )
    assert other.code == 2 and "another scene" in other.err
    assert cli("run", scene, "-o", tmp_path / "out", "--resume", "--no-page").code == 0
    assert not (tmp_path / "out" / "wear.npz").exists() and not (tmp_path / "out.partial").exists()


@pytest.mark.parametrize(
    "quiet, state, told", [((), "wear.npz", 1), (("-q",), "wear.npz", 0), ((), "", 0)]
)
def test_exact_a_new_run_says_once_that_it_discards_a_saved_state(tmp_path, quiet, state, told):
    scene = tmp_path / "plain.toml"
    scene.write_text(SINE + COULOMB + '[normal]\nload = "10 N"\n')
    (tmp_path / "out.partial").mkdir()
    if state:
        (tmp_path / "out.partial" / state).write_bytes(b"kept")
    answer = cli("run", scene, "-o", tmp_path / "out", "--no-page", *quiet)
    assert answer.code == 0, answer.err
    assert (
        answer.err.count("out.partial held the state of an interrupted run, which is now discarded")
        == told
    )
    assert not (tmp_path / "out.partial").exists() and not (tmp_path / "out" / "wear.npz").exists()


def test_refuses_to_go_on_where_nothing_is_kept(tmp_path):
    scene = tmp_path / "worn.toml"
    scene.write_text(TILTED + COULOMB + SINE + WEAR)
    answer = cli("run", scene, "-o", tmp_path / "out", "--resume")
    assert answer.code == 2 and "no interrupted run" in answer.err
    (tmp_path / "out.partial").mkdir(exist_ok=True)
    whole = io.BytesIO()
    np.savez(whole, key=np.zeros(1000))
    for damaged in (whole.getvalue()[:-200], b"", b"PK nothing"):
        (tmp_path / "out.partial" / "wear.npz").write_bytes(damaged)
        answer = cli("run", scene, "-o", tmp_path / "out", "--resume")
        assert answer.code == 2 and "cannot be read" in answer.err
    assert answer.code == 2 and "cannot be read" in answer.err and "Traceback" not in answer.err
    scene.write_text(TILTED + COULOMB + SINE)
    assert cli("run", scene, "-o", tmp_path / "out", "--resume").code == 2


def test_exact_wear_beside_a_step_is_that_of_an_independent_program():
    """Truth: `wear_scenes.answer`, a finite-element program of its own that integrates Archard's law."""
    measures = ran(wear_scenes.text_of(wear_scenes.draw(522015))).measures
    for name, truth, uncertainty in (
        ("approach", 1.1330e-6, 3.3e-10),
        ("normal_stiffness", 2.90147e9, 2e5),
        ("tangential_stiffness", 4.60476e8, 1e4),
        ("rotational_stiffness", 47219.2, 1.2),
    ):
        measure = measures[name]
        assert abs(measure.value - truth) <= measure.error + uncertainty, name
        assert measure.error < 1e-3 * measure.value, name
