"""Benches with a dwell or a table as sliding path: the path itself, and the growth of friction at
rest."""

import numpy as np
import pytest
from friction_forms import steady_bond_length
from scene_texts import COULOMB, POINT
from scipy.integrate import solve_ivp

from patchfem import build, new, plan, run
from patchfem.core import PatchfemError
from patchfem.runs.bench.slides import SlideTask
from patchfem.runs.run import hash_run
from patchfem.scene import load

SPEED, LENGTH, RATIO, A_S, L_K, FLOOR = 1e-3, 2e-6, 0.5, 2e-6, 1e-6, 1e-6
NONLOCAL = """[friction]
law = "nonlocal"
static = 0.3
kinetic = 0.15
bond_length = "2 um"
rest_growth = "2e-6 m/s^2"
slip_growth = "1 um"
rest_speed = "1 um/s"
"""
DWELL = '[slide]\nkind = "dwell"\nspeed = "1 mm/s"\ndistance = "40 um"\nhold = "0.3 s"\ndistance_after = "20 um"\n'


def breakaway_ratios(hold):
    """Return the largest and the last F/(mu_s N) of the 20 um after a rest, from an integration of
    dz/dx = 1 - z/eps with the bond length eps by equation 2.10: at rest eps_0 - (eps_0 - eps) exp(-a_s t/v_h)."""
    sliding_length = steady_bond_length(SPEED, LENGTH, RATIO, A_S, L_K)
    start = LENGTH - (LENGTH - sliding_length) * np.exp(-A_S * hold / FLOOR)
    rate = A_S / SPEED**2 + 1 / L_K
    solution = solve_ivp(
        lambda y, z: 1 - z / (sliding_length + (start - sliding_length) * np.exp(-rate * y)),
        (0, 20e-6),
        [sliding_length],
        method="DOP853",
        rtol=1e-12,
        atol=1e-18,
        max_step=1e-7,
    )
    return solution.y[0].max() / LENGTH, solution.y[0, -1] / LENGTH


@pytest.fixture
def write_path_scene(tmp_path):
    """Return a function that writes a table of the sliding path and loads a scene with it."""

    def write_table(text, friction=COULOMB, *sets):
        (tmp_path / "path.csv").write_bytes(text.encode() if isinstance(text, str) else text)
        scene = tmp_path / "scene.toml"
        scene.write_text(POINT + friction + '[slide]\nkind = "file"\nfile = "path.csv"\n', "utf-8")
        return load(scene, sets)

    return write_table


HEAD = "time [s],displacement [um]\n"


def test_saved_state_belongs_to_the_path_and_not_to_its_name(write_path_scene):
    """Runs with the same scene resume from one another only if the file of the path has the same rows."""
    keys = [
        hash_run(build(write_path_scene(f"{HEAD}0,0\n1,{end}\n")), None, "1") for end in (1, 1, 2)
    ]
    assert keys[0] == keys[1] != keys[2]


@pytest.mark.parametrize("text, message", [
    ("", ":1: a header like"), ("time,displacement\n0,0\n1,1\n", ":1: a header"), ("time [s],time [s]\n", ":1: a header"),
    ("time [s],displacement [N]\n0,0\n1,1\n", ":1: displacement [N]: unknown unit; use one of m, km"),
    (HEAD + "0,0\n\n", ":2: a path needs at least two rows"),
    (HEAD + "0,0\n1,nan\n", ":3: displacement: 'nan' is not a finite number"),
    (HEAD + "0,0\n1,1,2\n", ":3: the number of cells must be 2"),
    (HEAD + "0,0\n1,1\n1,2\n", ":4: time 1 s is not later than"),
    (HEAD + "0,5\n1,1\n", ":2: displacement starts at 5e-06"), (HEAD + "1,0\n2,1\n", ":2: time starts at 1"),
    (HEAD + "0,0\n1,0\n", "displacement is 0 in every row"), (b"\xff\xfe\x00", "cannot be read"),
])  # fmt: skip
def test_refuses_faulty_path_table_with_line(write_path_scene, text, message):
    """A faulty table of the sliding path is refused with its file, line and cause."""
    scene = write_path_scene(text)
    with pytest.raises(PatchfemError) as error:
        plan(scene)
    assert "path.csv" in str(error.value) and message in str(error.value)


def test_exact_breakaway_of_table_agrees_with_reference(write_path_scene):
    """Peak and final friction along a table of the path of the dwell agree with the reference within their errors."""
    result = run(write_path_scene(HEAD + "0,0\n0.04,40\n0.34,40\n0.36,60\n", NONLOCAL))
    peak = result.measures["friction_ratio_peak"]
    end = result.measures["friction_ratio_end"]
    peak_ratio, end_ratio = breakaway_ratios(0.3)
    assert abs(peak.value - 0.3 * peak_ratio) <= peak.error < 1e-3 * peak.value
    assert abs(end.value - 0.3 * end_ratio) <= max(end.error, 1e-9)
    assert "drift_per_cycle" not in result.measures


def test_exact_coulomb_bench_breaks_away_at_static_friction():
    """At the first instant and after a rest the force is mu_s N, while sliding mu_k N; the friction
    work depends only on mu_k."""
    result = run(POINT + COULOMB + "kinetic = 0.2\n" + DWELL)
    response = result.response
    load = response.load[0]
    force = response.force
    is_moving = np.diff(response.slide) > 0
    starts = np.flatnonzero(is_moving & ~np.append(False, is_moving[:-1]))
    assert starts.size == 2 and force[starts] == pytest.approx(0.3 * load, rel=1e-14)
    assert np.delete(force, starts) == pytest.approx(0.2 * load, rel=1e-14)
    assert result.measures["friction_ratio_peak"].value == pytest.approx(0.3)
    assert result.measures["friction_ratio_end"].value == 0.2
    assert result.measures["friction_work"].value == pytest.approx(0.2 * load * 60e-6, rel=1e-12)


def test_exact_friction_follows_changing_load_of_each_instant(monkeypatch):
    """The friction force of a changing load is the friction limit under the load of each instant.

    The loads of many samples are evaluated at once; a call for each sample took 100 times the CPU time.
    """
    sizes = []
    evaluate = SlideTask.evaluate_pressure

    def count_samples(task, samples):
        sizes.append(len(samples))
        return evaluate(task, samples)

    monkeypatch.setattr(SlideTask, "evaluate_pressure", count_samples)
    slide = '[slide]\nkind = "sine"\namplitude = "50 um"\nfrequency = "10 Hz"\ncycles = 100\n'
    load = POINT + 'amplitude = "20 N"\nfrequency = "33 Hz"\n'
    response = run(load + COULOMB + slide).response
    assert sum(sizes) >= response.time.size and len(sizes) < 0.01 * sum(sizes)
    moves = np.sign(np.diff(response.slide))
    assert np.ptp(response.load) > 39.0 and np.count_nonzero(moves) > 1000
    expected = 0.3 * response.load[1:] * moves
    assert response.force[1:][moves != 0] == pytest.approx(expected[moves != 0], rel=1e-13)


def test_exact_slip_amplitude_includes_what_lies_between_samples():
    """The slip of bonds turns round between two steps: its amplitude of few steps holds within its error."""
    few, many = (
        run(new("bench"), **{"accuracy.steps_per_cycle": steps}).measures["slip_amplitude"]
        for steps in (200, 3200)
    )
    assert abs(few.value - many.value) < few.error < 1e-3 * few.value
