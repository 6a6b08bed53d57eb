"""A bench along a path file in two directions, and a patch in strips along one: scenes against closed forms and
against the law stepped point by point."""

import numpy as np
import pytest
import xarray as xr
from command_line import cli
from scene_texts import NONLOCAL, POINT, SMALL_PATCH, TRIANGLE

from patchfem import build, plan
from patchfem.core import PatchfemError
from patchfem.friction import Bonds, FirstOrderBonds
from patchfem.runs import solve_with_coarser
from patchfem.runs.bench import bench as law_bench
from patchfem.runs.run import run
from patchfem.scene import load, loads

LONGER = NONLOCAL.replace("1 um", "2 um")
FILE = '[slide]\nkind = "file"\nfile = "path.csv"\n'
STRIPS = '[contact.strips]\ncount = 4\nroll = "0.02 mrad"\n'
L_SHAPE = "time [ms],displacement [um],lateral [um]\n0,0,0\n2,10,0\n6,10,20\n8,4,24\n"


@pytest.fixture
def table(tmp_path):
    def write(text, scene=POINT + LONGER, *sets):
        (tmp_path / "path.csv").write_text(text, "utf-8")
        (tmp_path / "scene.toml").write_text(scene + FILE, "utf-8")
        return load(tmp_path / "scene.toml", sets)

    return write


def ring(radius, turns, rows):
    """A circle through the origin that leaves it along +x, in um, one turn a second."""
    angle = np.linspace(0, 2 * np.pi * turns, round(rows * turns) + 1)
    lines = zip(
        (angle / (2 * np.pi)).tolist(),
        (radius * np.sin(angle)).tolist(),
        (radius * (1 - np.cos(angle))).tolist(),
    )
    return (
        "time [s],displacement [um],lateral [um]\n"
        + "\n".join(f"{t!r},{x!r},{y!r}" for t, x, y in lines)
        + "\n"
    )


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "radius, size, lag", [(1, 0.447214, 63.4349), (4, 0.894427, 26.5651), (20, 0.995037, 5.7106)]
)
def test_exact_c14_circle_of_a_bench_scene(table, radius, size, lag):
    """r = 0.5, 2, 10 bond lengths of 2 um: |F| and lag of the two resultants against the motion."""
    turns = {1: 6.25, 4: 2.25, 20: 0.75}[radius]
    model = build(table(ring(radius, turns, {1: 400, 4: 600, 20: 1500}[radius]), POINT + LONGER))
    found = law_bench.run(model, None, 4)
    force = (found.force[-1] + 1j * found.lateral_force[-1]) / (0.3 * found.load[0])
    motion = np.exp(2j * np.pi * turns)
    assert abs(force) == pytest.approx(size, abs=1e-5)
    assert -np.degrees(np.angle(force / motion)) == pytest.approx(lag, abs=2e-3)
    assert found.values["energy_balance"] < 1e-12 and found.yaw_moment is None
    assert model.speed_scale == pytest.approx(2e-6 * np.pi * radius, rel=1e-4)


@pytest.mark.parametrize("strips", ["", STRIPS])
def test_exact_every_point_of_a_patch_stepped_on_its_own(table, strips):
    """Resultants and yaw moment from the law at every node of every strip, with the pressure of that strip."""
    model = build(table(L_SHAPE, SMALL_PATCH + strips + LONGER))
    patch = solve_with_coarser(model.patch, 1e-3, False)[0]
    found = law_bench.run(model, patch, 60, 6)
    pressure = patch.strips.pressure if strips else patch.pressure.sigma_n[None]
    offsets = patch.strips.offsets if strips else np.zeros(1)
    count = len(pressure)
    flat = pressure.ravel()
    time = model.slide.samples(60)[0]
    corners = 1e-3 * np.array([0, 2, 6, 8])
    ways = 1e-6 * np.array([[0, 10, 10, 4], [0, 0, 20, 24]])
    path = np.stack([np.interp(time, corners, way) for way in ways], axis=1)
    law = FirstOrderBonds(Bonds(0.3, 2e-6))
    state = law.start(flat, 2)
    tractions = [np.zeros((2, flat.size))]
    for move, span in zip(np.diff(path, axis=0), np.diff(time)):
        state = law.step(state, move, flat, flat, span).state
        tractions.append(law.traction(state))
    tractions = np.array(tractions)
    forces = tractions * np.tile(patch.pieces.interface.weight / count, count)
    assert found.force == pytest.approx(forces[:, 0].sum(axis=1), rel=1e-9, abs=1e-9)
    assert found.lateral_force == pytest.approx(forces[:, 1].sum(axis=1), rel=1e-9, abs=1e-9)
    yaw = forces[:, 0] @ np.repeat(offsets, patch.x.size) - forces[:, 1] @ np.tile(patch.x, count)
    assert found.yaw_moment == pytest.approx(yaw, rel=1e-8, abs=1e-12) and np.abs(yaw).max() > 1e-3
    mean = tractions[found.frames, 0].reshape(len(found.frames), count, -1).mean(axis=1)
    assert found.tau == pytest.approx(mean, rel=1e-9, abs=1e-6)
    if strips:
        assert yaw[found.slide.argmax()] == pytest.approx(patch.strips.yaw_moment(0.3), rel=0.01)


def test_exact_histories_of_both_directions_are_written(table, tmp_path):
    scene = table(L_SHAPE, SMALL_PATCH + STRIPS + LONGER + "[accuracy]\nsteps_per_cycle = 100\n")
    answer = cli("run", scene.path, "-o", tmp_path / "out")
    assert answer.code == 0, answer.err
    result = run(scene, estimate=False)
    with xr.open_dataset(tmp_path / "out" / "result.nc", engine="h5netcdf") as data:
        for name, unit in (
            ("lateral_displacement", "m"),
            ("lateral_force", "N"),
            ("yaw_moment", "N m"),
        ):
            assert data[name].attrs["units"] == unit and data[name].dims == ("time",)
        assert data["lateral_force"].values == pytest.approx(result.response.lateral_force)
        assert data["lateral_displacement"].values[-1] == pytest.approx(24e-6)
    wide = table(L_SHAPE.replace("24", "2400"), SMALL_PATCH + LONGER, "accuracy.steps_per_cycle=50")
    assert any(
        "0.189 of the width" in w or "0.19 of the width" in w
        for w in run(wide, estimate=False).warnings
    )


@pytest.mark.parametrize(
    "text, says",
    [
        (L_SHAPE + "9,4\n", ":6: three cells"),
        (L_SHAPE + "9,4,x\n", ":6: lateral: 'x' is not a finite"),
        (L_SHAPE.replace("0,0,0", "0,0,3"), ":2: lateral starts at 3e-06"),
        (L_SHAPE.replace("lateral [um]", "lateral [s]"), ":1: lateral [s]: unknown unit"),
        (L_SHAPE.replace("lateral [um]", "sideways [um]"), ":1: a header like"),
        (L_SHAPE.replace("lateral [um]", "time [s]"), ":1: a header like"),
        ("time [s],displacement [um],lateral [um]\n0,0,0\n1,0,0\n", "nothing slides"),
    ],
)
def test_refuses_a_broken_lateral_column(table, text, says):
    with pytest.raises(PatchfemError) as error:
        plan(table(text))
    assert "path.csv" in str(error.value) and says in str(error.value)


@pytest.mark.parametrize(
    "scene, sets, says",
    [
        (POINT, ["friction.law=coulomb"], "law 'coulomb'"),
        (POINT, ["friction.law=elastic-plastic"], "law 'elastic-plastic'"),
        (POINT, ["friction.law=tanh", "friction.reference_speed=1 mm/s"], "law 'tanh'"),
        (POINT, ["friction.law=convolution"], "law 'convolution'"),
        (POINT, ["normal.width=1 mm", "friction.spread=1 um"], "friction.spread"),
        (POINT, ["friction.breakaway=0.2"], "friction.breakaway"),
        (POINT, ["normal.amplitude=1 N", "normal.frequency=50 Hz"], "normal.amplitude"),
        (SMALL_PATCH, ["contact.shear={}"], "[contact.shear]"),
        (SMALL_PATCH, ["contact.tilt.on=lower"], "a shape on the lower piece"),
    ],
)
def test_refuses_what_two_directions_cannot_do(table, scene, sets, says):
    found = table(L_SHAPE, scene + LONGER, *sets)
    for act in (lambda: plan(found), lambda: build(found)):
        with pytest.raises(PatchfemError) as error:
            act()
        assert str(error.value).startswith(f"{found.where('slide.file')}: a lateral column with")
        assert f"{says} is not supported yet; " in str(error.value)


# ---- strips along one direction


@pytest.mark.parametrize("side", ["upper", "lower"])
def test_exact_level_strips_are_the_patch(side):
    """Four level strips of a crown press as one: the bench is that of the patch without them, on either piece, and its
    resultant that of one point, but for the edges of a contact that moves over the lower piece."""
    level = STRIPS.replace('roll = "0.02 mrad"\n', "")
    crown = (
        SMALL_PATCH.split("[contact.tilt]")[0]
        + f'[contact.crown]\nradius = "20 m"\non = "{side}"\n'
    )
    one, two = (bench_of(crown + more + LONGER) for more in ("", level))
    assert two.force == pytest.approx(one.force, rel=1e-9, abs=1e-9 * one.force.max())
    assert two.tau == pytest.approx(one.tau, rel=1e-6, abs=1e-6 * one.tau.max())
    point = bench_of(POINT + LONGER)
    assert two.force == pytest.approx(
        point.force, abs=(1e-9 if side == "upper" else 1e-3) * point.force.max()
    )
    assert side == "upper" or two.force != pytest.approx(point.force, rel=1e-9)


def bench_of(text, *sets):
    model = build(loads(text + TRIANGLE, sets=sets))
    patch = solve_with_coarser(model.patch, 1e-3, False)[0] if model.patch is not None else None
    return law_bench.run(model, patch, 120, 4)
