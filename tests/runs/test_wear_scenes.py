"""Scenes with [wear]: volumes in closed form, the worn patch, shakedown, refusals and files."""

import io
import json

import h5py
import numpy as np
import pytest
import wear_scenes
from command_line import run_cli
from pieces import make_bare_layers, make_refined_grid
from pressed import solve_forces
from scene_texts import (
    COATED,
    COULOMB,
    MODE,
    NONLOCAL,
    POINT,
    SHEAR,
    STRUCTURE,
    get_only_mistake,
    list_mistakes,
)
from scipy.optimize import brentq

import patchfem as pf
from patchfem.closed_forms.contact import hertz_half_width, hertz_peak
from patchfem.core import Compliance, Interface
from patchfem.elasticity import Piece, interface_compliance
from patchfem.runs.wear import evolve
from patchfem.scene import loads
from patchfem.slip import jenkins_set
from patchfem.wear import WearProblem, make_initial_wear_state, take_jump

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
LONG_WEAR = WEAR.replace("135723", "1e9").replace("1e-14", "1e-13")
WORN_THROUGH_SCENE = (
    TILTED + COULOMB + SINE + LONG_WEAR
)  # The coating is worn through before the last cycle.
LARGE_TOLERANCE = "[accuracy]\ntolerance = 2e-2\n"


def run_text(text, **sets):
    """Return the result of a scene with some keys replaced."""
    return pf.run(loads(text, "wear.toml"), **sets)


def test_exact_worn_volume_is_coefficient_times_load_times_path():
    """The worn volume is kappa N s n within 1e-12; wear widens the contact, lowers the peak and keeps the loop."""
    worn = run_text(TILTED + COULOMB + SINE + WEAR)
    volume = worn.measures["worn_volume"]
    assert volume.value == pytest.approx(KAPPA * LOAD * 40e-6 * CYCLES, rel=1e-12)
    assert 0 < volume.error <= 1e-3 * volume.value
    unworn = run_text(TILTED + COULOMB + SINE)
    assert worn.measures["contact_fraction"].value > 1.4 * unworn.measures["contact_fraction"].value
    assert worn.measures["pressure_peak"].value < 0.6 * unworn.measures["pressure_peak"].value
    assert worn.measures["loop_area"].value == pytest.approx(
        unworn.measures["loop_area"].value, rel=1e-12
    )


@pytest.mark.parametrize("motion", [SINE, STRUCTURE], ids=["bench", "rig"])
def test_exact_point_contact_wear_agrees_with_archard(motion):
    """The worn volume of a point contact is kappa N 4 A n, on a bench and in a rig."""
    result = run_text(POINT + COULOMB + motion + WEAR)
    amplitude = result.measures["slip_amplitude"].value
    assert result.measures["worn_volume"].value == pytest.approx(
        KAPPA * LOAD * 4 * amplitude * CYCLES, rel=2e-3
    )
    assert "worn_depth_max" not in result.measures


@pytest.mark.share(0, 3)
@pytest.mark.parametrize(
    "table",
    [
        '[contact.asperities]\nlaw = "exponential"\nnormal_stiffness = "1e13 Pa/m"\ndecay_length = "2.5 um"\n',
        '[contact.asperities]\nlaw = "hertz"\nradius = "10 um"\ndensity = "1e10 1/m^2"\nheight_deviation = "0.5 um"\n',
        '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e13 Pa/m"\n',
        '[contact.holder]\nrotational_stiffness = "1e4 N m/rad"\n',
        '[contact.crown]\nradius = "1 m"\n',
    ],
    ids=["exponential", "hertz", "linear", "holder", "crown"],
)
def test_exact_worn_volume_does_not_depend_on_skin_or_shape(table):
    """The worn volume is kappa N s n for every skin, holder and shape."""
    result = run_text(TILTED + table + COULOMB + SINE + WEAR)
    assert result.measures["worn_volume"].value == pytest.approx(
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
def test_exact_non_periodic_slide_counts_as_one_wear_cycle(slide, path):
    """A slide that does not repeat counts as one wear cycle of its whole path."""
    for contact in (TILTED, TILTED + SHEAR):
        volume = run_text(contact + COULOMB + f"[slide]\n{slide}\n" + WEAR).measures["worn_volume"]
        assert volume.value == pytest.approx(
            KAPPA * LOAD * path * CYCLES, rel=1e-12 if contact == TILTED else 0.06
        )


@pytest.fixture(scope="module")
def worn_folder(tmp_path_factory):
    """Return the results folder of a worn bench."""
    scene = tmp_path_factory.mktemp("worn") / "worn.toml"
    scene.write_text(TILTED + COULOMB + SINE + WEAR)
    answer = run_cli("run", scene, "-o", scene.parent / "out", "-q")
    assert answer.code == 0, answer.err
    return scene.parent / "out"


def test_exact_piece_displacements_agree_with_gap_and_worn_depth(worn_folder):
    """The distance between the displaced interfaces changes from frame to frame by the gap minus
    the worn depth."""
    with h5py.File(worn_folder / "fields.vtkhdf") as file:
        interface = file["VTKHDF/interface"]
        nodes = len(interface["Points"])
        gap, worn_depth = (
            interface[f"PointData/{name}"][:].reshape(-1, nodes) for name in ("gap", "worn_depth")
        )
        sides = []
        for body in (file["VTKHDF/lower"], file["VTKHDF/upper"]):
            points = body["Points"][:]
            on_interface = np.flatnonzero(np.abs(points[:, 1]) < 1e-12)
            assert on_interface.size == nodes
            sides.append(
                body["PointData/displacement"][:].reshape(-1, len(points), 3)[:, on_interface, 1]
            )
        distance = sides[1] - sides[0]
        expected = gap - worn_depth
        change = np.ptp(expected, axis=0).max()
        assert np.abs((distance - distance[0]) - (expected - expected[0])).max() < 1e-5 * change


@pytest.mark.slow
def test_exact_wear_shakedown_of_crown_agrees_with_closed_form():
    """For a Cattaneo-Mindlin contact with Q = 0.6 mu P, the stick zone c = a0 sqrt(0.4) stays and
    finally carries the whole load.

    The pressure in the middle tends to c/a0 + 0.6 P/(pi c p0) of the Hertz peak: Hertz pressure
    under 0.4 P and a flat punch under the rest. Normal and tangential compliance are equal, as for
    two half-planes (Ciavarella and Hills, 1999).
    """
    width = 10e-3
    radius = 0.05
    line = 1e5
    mu = 0.5
    young = 121e9
    cells = 24
    half = hertz_half_width(line, radius, young / (1 - 0.32**2) / 2)
    peak = hertz_peak(line, radius, young / (1 - 0.32**2) / 2)
    stick = half * np.sqrt(0.4)
    grid = make_refined_grid(1.5 * half, half / cells, 40 * half, 20 * half, 1.15)
    nn, _, _ = interface_compliance(Piece(grid, make_bare_layers((young, 0.32))))
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

    problem = WearProblem(press, path, area, 1e-13, 1e9)
    state = make_initial_wear_state(problem)
    count = 0
    initial_work = state.path @ state.force
    while state.cycle < problem.cycles:
        state = take_jump(problem, state, 1e-2)
        count = count + 1
    in_stick_zone = np.abs(x) < stick
    assert count < 60
    assert (state.path[in_stick_zone] == 0).all() and not state.depth[in_stick_zone].any()
    assert state.force[in_stick_zone].sum() == pytest.approx(load, rel=1e-9)
    assert state.path @ state.force < 1e-9 * initial_work
    centre_ratio = (state.force / area)[np.argmin(np.abs(x))] / peak
    assert centre_ratio == pytest.approx(
        stick / half + 0.6 * line / (np.pi * stick * peak), abs=2e-3
    )


def test_refuses_wear_without_steady_motion():
    """Wear is refused for a static patch and for a release, which has no steady motion."""
    assert any("wear" in line for line in list_mistakes(TILTED + WEAR))
    release = (
        POINT
        + COULOMB
        + MODE
        + '[drive]\nkind = "free"\ndisplacement = "1 mm"\ncycles = 5\n'
        + WEAR
    )
    assert "steady motion" in get_only_mistake(release)


def test_always_unbounded_motion_has_no_wear():
    """A motion that grows or leaves the contact has no wear, and a warning says so."""
    for contact, outcome in ((TILTED, "leaves_contact"), (POINT, "grows")):
        result = run_text(
            contact
            + COULOMB
            + MODE.replace("0.003", "0.0")
            + '[drive]\nkind = "base"\nfrequency = "143 Hz"\n'
            'acceleration = "9 g"\ncycles = 100\n' + WEAR
        )
        assert result.outcome == outcome and "worn_volume" not in result.measures
        assert any("nothing was worn" in line for line in result.warnings)


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "text",
    [
        TILTED + COULOMB + SINE + WEAR + "jumps = 3\n",
        SOFT_RIG + WEAR + "jumps = 2\n" + LARGE_TOLERANCE,
        TILTED + COULOMB + SINE + WEAR,
        SOFT_RIG + WEAR + LARGE_TOLERANCE,
        WORN_THROUGH_SCENE + "jumps = 40\n",
    ],
    ids=["bench_jumps", "rig_jumps", "bench", "rig", "worn_through"],
)
def test_exact_resumed_wear_run_writes_identical_files(tmp_path, monkeypatch, text):
    """A run that is resumed from its first and last saved state writes the same bytes as
    the uninterrupted run."""
    scene = tmp_path / "worn.toml"
    states = []
    scene.write_text(text)

    save = evolve.save_wear_state

    def save_and_record(path, *arguments):
        save(path, *arguments)
        states.append(path.read_bytes())

    with monkeypatch.context() as patched:
        patched.setattr(evolve, "save_wear_state", save_and_record)
        assert run_cli("run", scene, "-o", tmp_path / "whole", "-q", "--no-page").code == 0
    assert len(states) >= 2
    for state in (states[0], states[-1]):
        (tmp_path / "out.partial").mkdir()
        (tmp_path / "out.partial" / "wear.npz").write_bytes(state)
        resumed = run_cli("run", scene, "-o", tmp_path / "out", "--resume", "-q", "--no-page")
        assert resumed.code == 0 and "held the state" not in resumed.err
        for name in ("result.nc", "fields.vtkhdf", "scene.resolved.toml"):
            assert (tmp_path / "out" / name).read_bytes() == (
                tmp_path / "whole" / name
            ).read_bytes(), name
        full_summary, resumed_summary = (
            json.loads((tmp_path / name / "summary.json").read_text()) for name in ("whole", "out")
        )
        times = dict.fromkeys(("seconds", "effects", "accuracy_seconds"), 0)
        assert full_summary | times == resumed_summary | times


@pytest.mark.share(2)
@pytest.mark.parametrize("wear_keys", ["jumps = 3\n", "", "upper_share = 0.2\njumps = 40\n"])
def test_exact_worn_through_coating_ends_run(wear_keys):
    """A run ends when the coating is worn through: the volume is that of the cycles so far, and the
    largest depth is the coating thickness of the piece that wears more."""
    result = run_text(WORN_THROUGH_SCENE + wear_keys)
    cycle = result.measures["worn_through_cycle"]
    coating = 6 * 25.4e-6
    wear_share = 0.8 if "share" in wear_keys else 0.5
    assert result.outcome == "worn_through" and 0 < cycle.value < 1e9
    assert result.measures["worn_depth_max"].value * wear_share == pytest.approx(coating, rel=1e-6)
    volume = result.measures["worn_volume"].value
    assert volume == pytest.approx(1e-13 * LOAD * 40e-6 * cycle.value, rel=1e-12)
    assert result.extra["wear"]["cycle"][-1] == cycle.value
    assert (
        any(
            f"lower piece, {152.4:.4g} um, is worn through" in text
            for text in result.extra["notes"]
        )
        or wear_share == 0.5
    )
    # The mean depth is the volume over the area; the tilt adds to the largest depth.
    mean_depth = volume / (12.7e-3) ** 2
    assert mean_depth < result.measures["worn_depth_max"].value < mean_depth + 0.1e-3 * 12.7e-3
    results = [
        run_text(WORN_THROUGH_SCENE.replace("1e9", repr(cycle.value + offset)) + wear_keys)
        for offset in (-cycle.error, cycle.error)
    ]
    assert [result_.outcome == "worn_through" for result_ in results] == [False, True]


def test_refuses_to_resume_run_of_other_scene(tmp_path, monkeypatch):
    """An interrupted wear run is resumed only by the same scene."""
    scene = tmp_path / "worn.toml"
    save = evolve.save_wear_state
    scene.write_text(TILTED + COULOMB + SINE + WEAR)

    def save_and_interrupt(*arguments):
        save(*arguments)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(evolve, "save_wear_state", save_and_interrupt)
        answer = run_cli("run", scene, "-o", tmp_path / "out", "--no-page")
    assert answer.code == 130 and "--resume" in answer.err
    assert [path.name for path in (tmp_path / "out.partial").iterdir()] == ["wear.npz"]
    other = run_cli(
        "run", scene, "-o", tmp_path / "out", "--resume", "--set", "wear.coefficient=2e-14 m^2/N"
    )
    assert other.code == 2 and "another scene" in other.err
    assert run_cli("run", scene, "-o", tmp_path / "out", "--resume", "--no-page").code == 0
    assert not (tmp_path / "out" / "wear.npz").exists() and not (tmp_path / "out.partial").exists()


@pytest.mark.parametrize("quiet, state, n_messages", [((), "wear.npz", 1), ((), "", 0)])
def test_exact_new_run_reports_discarded_state_once(tmp_path, quiet, state, n_messages):
    """A new run reports once that it discards the saved state of an interrupted run."""
    scene = tmp_path / "plain.toml"
    scene.write_text(SINE + COULOMB + '[normal]\nload = "10 N"\n')
    (tmp_path / "out.partial").mkdir()
    if state:
        (tmp_path / "out.partial" / state).write_bytes(b"kept")
    answer = run_cli("run", scene, "-o", tmp_path / "out", "--no-page", *quiet)
    assert answer.code == 0, answer.err
    assert (
        answer.err.count("out.partial held the state of an interrupted run, which is now discarded")
        == n_messages
    )
    assert not (tmp_path / "out.partial").exists() and not (tmp_path / "out" / "wear.npz").exists()


def test_refuses_to_resume_without_valid_state(tmp_path):
    """Resuming is refused without a saved state, with a damaged one, and for a scene without wear."""
    scene = tmp_path / "worn.toml"
    scene.write_text(TILTED + COULOMB + SINE + WEAR)
    answer = run_cli("run", scene, "-o", tmp_path / "out", "--resume")
    assert answer.code == 2 and "no interrupted run" in answer.err
    (tmp_path / "out.partial").mkdir(exist_ok=True)
    archive = io.BytesIO()
    np.savez(archive, key=np.zeros(1000))
    for damaged in (archive.getvalue()[:-200], b"", b"PK nothing"):
        (tmp_path / "out.partial" / "wear.npz").write_bytes(damaged)
        answer = run_cli("run", scene, "-o", tmp_path / "out", "--resume")
        assert answer.code == 2 and "cannot be read" in answer.err
    assert answer.code == 2 and "cannot be read" in answer.err and "Traceback" not in answer.err
    scene.write_text(TILTED + COULOMB + SINE)
    assert run_cli("run", scene, "-o", tmp_path / "out", "--resume").code == 2


def test_exact_wear_at_step_agrees_with_independent_program():
    """The reference is `wear_scenes.solve_scene`, an independent finite-element program that integrates
    Archard's law."""
    measures = run_text(wear_scenes.format_scene(wear_scenes.draw_scene(522015))).measures
    for name, reference, uncertainty in (
        ("approach", 1.1330e-6, 3.3e-10),
        ("normal_stiffness", 2.90147e9, 2e5),
        ("tangential_stiffness", 4.60476e8, 1e4),
        ("rotational_stiffness", 47219.2, 1.2),
    ):
        measure = measures[name]
        assert abs(measure.value - reference) <= measure.error + uncertainty, name
        assert measure.error < 1e-3 * measure.value, name
