"""Benches along a path in two directions, and patches in strips: scenes against closed forms and
the NumPy law."""

import numpy as np
import pytest
from scene_texts import NONLOCAL, POINT, SMALL_PATCH

from patchfem import build, plan
from patchfem.core import PatchfemError
from patchfem.friction import Bonds, FirstOrderBonds
from patchfem.runs import solve_with_coarser
from patchfem.runs.bench import bench as law_bench
from patchfem.scene import load

LONGER_BONDS = NONLOCAL.replace("1 um", "2 um")
FILE_SLIDE = '[slide]\nkind = "file"\nfile = "path.csv"\n'
STRIPS = '[contact.strips]\ncount = 4\nroll = "0.02 mrad"\n'
L_SHAPE = "time [ms],displacement [um],lateral [um]\n0,0,0\n2,10,0\n6,10,20\n8,4,24\n"


@pytest.fixture
def write_path_scene(tmp_path):
    """Return a function that writes the table of a path and loads a scene with it."""

    def write_table(text, scene=POINT + LONGER_BONDS, *sets):
        (tmp_path / "path.csv").write_text(text, "utf-8")
        (tmp_path / "scene.toml").write_text(scene + FILE_SLIDE, "utf-8")
        return load(tmp_path / "scene.toml", sets)

    return write_table


def format_circle_path(radius, revolutions, rows):
    """Return the table of a circle through the origin that starts along +x, with radius in um and
    one revolution per second."""
    angle = np.linspace(0, 2 * np.pi * revolutions, round(rows * revolutions) + 1)
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
    "radius, force_ratio, lag",
    [(1, 0.447214, 63.4349), (4, 0.894427, 26.5651), (20, 0.995037, 5.7106)],
)
def test_exact_friction_on_circular_path_agrees_with_closed_form(
    write_path_scene, radius, force_ratio, lag
):
    """For radii of 0.5, 2 and 10 bond lengths of 2 um, the magnitude of the friction force and its
    lag behind the motion agree with the closed form."""
    revolutions = {1: 6.25, 4: 2.25, 20: 0.75}[radius]
    model = build(
        write_path_scene(
            format_circle_path(radius, revolutions, {1: 400, 4: 600, 20: 1500}[radius]),
            POINT + LONGER_BONDS,
        )
    )
    response = law_bench.run_bench(model, None, 4)
    force = (response.force[-1] + 1j * response.lateral_force[-1]) / (0.3 * response.load[0])
    motion = np.exp(2j * np.pi * revolutions)
    assert abs(force) == pytest.approx(force_ratio, abs=1e-5)
    assert -np.degrees(np.angle(force / motion)) == pytest.approx(lag, abs=2e-3)
    assert response.values["energy_balance"] < 1e-12 and response.yaw_moment is None
    assert model.speed_scale == pytest.approx(2e-6 * np.pi * radius, rel=1e-4)


@pytest.mark.parametrize("strips", ["", STRIPS])
def test_exact_patch_on_plane_path_agrees_with_pointwise_law(write_path_scene, strips):
    """Friction forces and yaw moment agree with the law stepped at every node of every strip, with
    the pressure of this strip."""
    model = build(write_path_scene(L_SHAPE, SMALL_PATCH + strips + LONGER_BONDS))
    patch = solve_with_coarser(model.patch, 1e-3, False)[0]
    response = law_bench.run_bench(model, patch, 60, 6)
    pressure = patch.strips.pressure if strips else patch.pressure.sigma_n[None]
    offsets = patch.strips.offsets if strips else np.zeros(1)
    count = len(pressure)
    flat = pressure.ravel()
    time = model.slide.samples(60)[0]
    corners = 1e-3 * np.array([0, 2, 6, 8])
    corner_points = 1e-6 * np.array([[0, 10, 10, 4], [0, 0, 20, 24]])
    path = np.stack(
        [np.interp(time, corners, coordinates) for coordinates in corner_points], axis=1
    )
    law = FirstOrderBonds(Bonds(0.3, 2e-6))
    state = law.initial_state(flat, 2)
    tractions = [np.zeros((2, flat.size))]
    for increment, span in zip(np.diff(path, axis=0), np.diff(time)):
        state = law.step(state, increment, flat, flat, span).state
        tractions.append(law.traction(state))
    tractions = np.array(tractions)
    forces = tractions * np.tile(patch.pieces.interface.weight / count, count)
    assert response.force == pytest.approx(forces[:, 0].sum(axis=1), rel=1e-9, abs=1e-9)
    assert response.lateral_force == pytest.approx(forces[:, 1].sum(axis=1), rel=1e-9, abs=1e-9)
    yaw = forces[:, 0] @ np.repeat(offsets, patch.x.size) - forces[:, 1] @ np.tile(patch.x, count)
    assert (
        response.yaw_moment == pytest.approx(yaw, rel=1e-8, abs=1e-12) and np.abs(yaw).max() > 1e-3
    )
    mean = tractions[response.frames, 0].reshape(len(response.frames), count, -1).mean(axis=1)
    assert response.tau == pytest.approx(mean, rel=1e-9, abs=1e-6)
    if strips:
        assert yaw[response.slide.argmax()] == pytest.approx(patch.strips.yaw_moment(0.3), rel=0.01)


@pytest.mark.parametrize(
    "text, message",
    [
        (L_SHAPE + "9,4\n", ":6: three cells"),
        (L_SHAPE.replace("0,0,0", "0,0,3"), ":2: lateral starts at 3e-06"),
        (L_SHAPE.replace("lateral [um]", "lateral [s]"), ":1: lateral [s]: unknown unit"),
        (L_SHAPE.replace("lateral [um]", "sideways [um]"), ":1: a header like"),
        ("time [s],displacement [um],lateral [um]\n0,0,0\n1,0,0\n", "nothing slides"),
    ],
)
def test_refuses_faulty_lateral_column(write_path_scene, text, message):
    """A faulty lateral column is refused with its file, line and cause."""
    with pytest.raises(PatchfemError) as error:
        plan(write_path_scene(text))
    assert "path.csv" in str(error.value) and message in str(error.value)


@pytest.mark.parametrize(
    "scene, sets, option",
    [
        (POINT, ["friction.law=coulomb"], "law 'coulomb'"),
        (POINT, ["normal.width=1 mm", "friction.spread=1 um"], "friction.spread"),
        (POINT, ["friction.breakaway=0.2"], "friction.breakaway"),
        (POINT, ["normal.amplitude=1 N", "normal.frequency=50 Hz"], "normal.amplitude"),
        (SMALL_PATCH, ["contact.shear={}"], "[contact.shear]"),
        (SMALL_PATCH, ["contact.tilt.on=lower"], "a shape on the lower piece"),
    ],
)
def test_refuses_unsupported_options_of_plane_path(write_path_scene, scene, sets, option):
    """Laws and options without a form in a plane are refused with a lateral column, by plan and run."""
    path_scene = write_path_scene(L_SHAPE, scene + LONGER_BONDS, *sets)
    for call in (lambda: plan(path_scene), lambda: build(path_scene)):
        with pytest.raises(PatchfemError) as error:
            call()
        assert str(error.value).startswith(
            f"{path_scene.where('slide.file')}: a lateral column with"
        )
        assert f"{option} is not supported yet; " in str(error.value)


# ---- strips along one direction
