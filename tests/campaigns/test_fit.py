"""Parameters of each friction law fitted to friction loops, and output and refusals of the fit command."""

import math
from pathlib import Path

import numpy as np
import pytest
from command_line import read_json, run_cli, run_successfully
from friction_loops import dahl_force, elastic_plastic_force, write_loop
from scene_texts import CROWNED_JOINT

from patchfem import FitOptions, SceneError, build
from patchfem.campaigns.fits.loop import LoopComparison
from patchfem.campaigns.fits.request import fit_measurement
from patchfem.campaigns.free_keys import parse_ranges
from patchfem.campaigns.held_out import select_held_out
from patchfem.core import PatchfemError
from patchfem.export.fits import format_fitted_scene
from patchfem.inputs import read_loop
from patchfem.runs.bench import bench
from patchfem.runs.patch.case_meshes import solve_with_coarser
from patchfem.scene import load, loads

LOAD = 100.0
POINT = '[normal]\nload = "100 N"\n'
SINE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "100 Hz"\ncycles = 2\n'
PATCH = (
    '[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\nload = "80 N"\nelement_size = "2 mm"\n'
    'substrate = "Ti-8Al-1Mo-1V"\n'
)
LAWS = {
    "coulomb": '[friction]\nlaw = "coulomb"\nstatic = 0.5\n',
    "elastic-plastic": '[friction]\nlaw = "elastic-plastic"\nstatic = 0.5\nbond_length = "5 um"\n',
    "springs": '[friction]\nlaw = "elastic-plastic"\nstatic = 0.5\nstiffness = "10 N/um"\n',
    "tanh": '[friction]\nlaw = "tanh"\nstatic = 0.5\nreference_speed = "5 mm/s"\n',
    "bonds": '[friction]\nlaw = "nonlocal"\nstatic = 0.5\nbond_length = "5 um"\n',
    "growth": '[friction]\nlaw = "nonlocal"\nstatic = 0.35\nkinetic = 0.2\nbond_length = "3 um"\nrest_growth = '
              '"4 m/s^2"\nslip_growth = "2 um"\nrest_speed = "0.01 mm/s"\n',
}  # fmt: skip
TRUTH = {
    "coulomb": {"friction.static": 0.31},
    "elastic-plastic": {"friction.static": 0.31, "friction.bond_length": 2.3e-6},
    "springs": {"friction.static": 0.31, "friction.stiffness": 1.3e7},
    "tanh": {"friction.static": 0.31, "friction.reference_speed": 1.7e-3},
    "bonds": {"friction.static": 0.31, "friction.bond_length": 2.3e-6},
}
FREE = {
    "friction.static": "0.1..0.7", "friction.bond_length": "0.3 um..20 um",
    "friction.stiffness": "2e6 N/m..1e8 N/m",
    "friction.reference_speed": "0.1 mm/s..100 mm/s",
}  # fmt: skip


def sine_path(count=80, cycles=2):
    """Return time [s] and relative displacement [m] of a sine of 10 um at 100 Hz, (n,) each."""
    time = np.arange(count * cycles + 1) / count / 100
    return time, 10e-6 * np.sin(2 * np.pi * 100 * time)


def reference_force(law, time, slide, truth):
    """Return the friction force (n,) [N] of a law, computed without the package where a formula exists."""
    values = list(truth.values())
    if law == "elastic-plastic":
        return elastic_plastic_force(slide, values[0] * LOAD, values[1])
    if law == "springs":
        return elastic_plastic_force(slide, values[0] * LOAD, values[0] * LOAD / values[1])
    if law == "bonds":
        return dahl_force(slide, values[0] * LOAD, values[1])
    speed = np.diff(slide) / np.diff(time)
    side = np.sign(speed) if law == "coulomb" else np.tanh(speed / values[1])
    # The force at a row is the mean of those of the two adjacent segments.
    both = np.concatenate([side[:1], (side[1:] + side[:-1]) / 2, side[-1:]])
    return values[0] * LOAD * both


def load_scene(tmp_path, law, *sets, slide=SINE):
    """Return the scene of a single point with a friction law, after writing its file."""
    path = tmp_path / "scene.toml"
    path.write_text(POINT + LAWS[law] + slide, "utf-8")
    return load(path, sets)


def free_ranges(*names):
    """Return the ranges of the given keys."""
    return parse_ranges([f"{name}={FREE[name]}" for name in names])


# ---- each law from a loop with known parameters


@pytest.mark.parametrize("law", ["coulomb", "elastic-plastic", "springs", "tanh", "bonds"])
def test_exact_parameters_of_each_law_are_recovered(tmp_path, law):
    """The parameters of each law are recovered from a computed loop within 1e-6."""
    time, slide = sine_path()
    loop = write_loop(
        tmp_path / "loop.csv", time, slide, reference_force(law, time, slide, TRUTH[law])
    )
    result = fit_measurement(load_scene(tmp_path, law), loop, free_ranges(*TRUTH[law]))
    assert result.fit.values == pytest.approx(list(TRUTH[law].values()), rel=1e-6)
    assert result.fit.rms < 1e-7 * LOAD and result.comparison.step_error == pytest.approx(
        0, abs=1e-9
    )
    assert (result.fit.intervals.ends[:, 0] <= result.fit.values).all() and result.warnings == []
    assert np.ptp(result.fit.intervals.ends, axis=1) == pytest.approx(0, abs=1e-6)


def test_exact_ratio_column_and_patch_give_same_parameters(tmp_path):
    """A column of friction ratios gives the same parameters for a point and for a patch.

    The resultant of a patch in rigid sliding is the friction force of a single point.
    """
    time, slide = sine_path(24)
    ratio = reference_force("bonds", time, slide, TRUTH["bonds"]) / LOAD
    loop = write_loop(tmp_path / "loop.csv", time, slide, ratio, quantity="friction_ratio")
    (tmp_path / "patch.toml").write_text(PATCH + LAWS["bonds"] + SINE, "utf-8")
    for scene in (load_scene(tmp_path, "bonds", "normal.load=7 N"), load(tmp_path / "patch.toml")):
        result = fit_measurement(scene, loop, free_ranges(*TRUTH["bonds"]))
        assert result.fit.values == pytest.approx(list(TRUTH["bonds"].values()), rel=1e-6)
    assert "could not be measured: the mesh has only 7 columns" in result.warnings[-1]


def test_always_mesh_error_of_fit_holds(tmp_path):
    """The error of the mesh of a fit holds also where a run would refine this mesh further."""
    time, slide = sine_path(40, 1)
    path = write_loop(tmp_path / "loop.csv", time, 0.3 * slide, slide)
    text = CROWNED_JOINT + SINE + "[accuracy]\ntolerance = 1e-5\n"
    bench_model = LoopComparison(loads(text), path, [])
    reading = bench_model.compute([])
    error = np.abs(bench_model.estimate_mesh_error([])).max()
    bench_model.patch = solve_with_coarser(build(loads(text)).patch, 1e-5)[0]
    deviation = np.abs(bench_model.compute([]) - reading).max()
    assert error > deviation > 1e-4 * np.abs(reading).max()


def test_exact_force_of_elastic_pieces_does_not_jump_at_reversals(tmp_path):
    """Elastic pieces that slide before every row have the full force in it, also where the slide turns round."""
    time, slide = sine_path(24)
    force = 0.31 * 80 * np.sign(np.diff(slide, prepend=0.0))
    loop = write_loop(tmp_path / "loop.csv", time, slide, force)
    (tmp_path / "patch.toml").write_text(
        PATCH + "[contact.shear]\n" + LAWS["coulomb"] + SINE, "utf-8"
    )
    result = fit_measurement(load(tmp_path / "patch.toml"), loop, free_ranges("friction.static"))
    assert result.fit.values == pytest.approx([0.31], rel=1e-9) and result.fit.rms < 1e-7 * 80


# ---- parameters that the rows do not determine, and doubtful records


def test_exact_excluded_rows_do_not_change_the_fit(tmp_path):
    """Rows excluded by `--hold` change nothing but their own rms.

    The motion of the excluded cycle is computed, but its force, here twice the true one, is not
    fitted.
    """
    time, slide = sine_path(40)
    force = elastic_plastic_force(slide, 0.31 * LOAD, 2.3e-6)
    cycle = 1 + (np.arange(81) > 40)
    wrong = write_loop(tmp_path / "wrong.csv", time, slide, force * cycle, cycle)
    scene = load_scene(tmp_path, "elastic-plastic")
    result = fit_measurement(
        scene,
        wrong,
        free_ranges("friction.static", "friction.bond_length"),
        FitOptions(["cycle=2.0"]),
    )
    assert result.fit.values == pytest.approx([0.31, 2.3e-6], rel=1e-6) and result.fit.rms < 1e-6
    assert result.score_predictions()["held_out_rms"] == pytest.approx(
        np.sqrt(np.mean(force[cycle == 2] ** 2)), rel=1e-6
    )
    assert result.held_out.sum() == 40
    first = fit_measurement(
        scene,
        write_loop(tmp_path / "late.csv", time, slide, np.where(cycle == 1, 5.0, force), cycle),
        free_ranges("friction.static", "friction.bond_length"),
        FitOptions(["cycle=1"]),
    )
    assert first.fit.values == pytest.approx([0.31, 2.3e-6], rel=1e-6)


def test_exact_parameters_of_steady_loop_follow_from_repeated_cycles(tmp_path):
    """Parameters are recovered from a loop cut out of a steady motion, if its cycle comes first once more, held out.

    Without it the fit is poor and proposes `--hold`.
    """
    time, slide = sine_path(80, 4)
    force = dahl_force(slide, 0.31 * LOAD, 2.3e-6)
    names = ("friction.static", "friction.bond_length")
    cut = slice(93, 254)
    scene = load_scene(tmp_path, "bonds")
    loop = write_loop(tmp_path / "loop.csv", time[cut], slide[cut], force[cut])
    plain = fit_measurement(scene, loop, free_ranges(*names))
    assert plain.fit.rms > 1.0 and any("--hold cycle=1" in one for one in plain.warnings)
    rows = np.r_[93:253, 93:254]
    cycle = 1 + (np.arange(rows.size) >= 160)
    steps = np.arange(rows.size) / 8000
    loop = write_loop(tmp_path / "loop.csv", steps, slide[rows], force[rows], cycle)
    result = fit_measurement(scene, loop, free_ranges(*names), FitOptions(["cycle=1"]))
    assert result.fit.values == pytest.approx([0.31, 2.3e-6], rel=1e-5)
    assert result.fit.rms < 1e-5 * LOAD and result.warnings == []


def test_always_doubtful_records_give_warnings(tmp_path):
    """Correlated rows and a nonzero first force give warnings."""
    time, slide = sine_path(40)
    late = elastic_plastic_force(slide, 0.31 * LOAD, 2.3e-6)[20:]
    result = fit_measurement(
        load_scene(tmp_path, "elastic-plastic"),
        write_loop(
            tmp_path / "loop.csv", time[20:], slide[20:], late + 3 * np.sin(np.arange(61) / 9)
        ),
        free_ranges("friction.static", "friction.bond_length"),
    )
    assert [
        any(text in one for one in result.warnings)
        for text in (
            "rows are correlated",
            "the force in the first row is",
        )
    ] == [True] * 2


# ---- records without time


def test_exact_missing_time_is_replaced_for_rate_independent_laws(tmp_path):
    """A record without time is fitted with uniform time steps if the law is rate independent; other laws need the times."""
    slide = sine_path(40)[1]
    text = "displacement [um],force [N]\n" + "\n".join(
        f"{1e6 * q!r},{f!r}"
        for q, f in zip(slide.tolist(), elastic_plastic_force(slide, 0.31 * LOAD, 2.3e-6).tolist())
    )
    loop = tmp_path / "loop.csv"
    loop.write_text(text)
    result = fit_measurement(
        load_scene(tmp_path, "elastic-plastic"),
        loop,
        free_ranges("friction.static", "friction.bond_length"),
    )
    assert result.fit.values == pytest.approx([0.31, 2.3e-6], rel=1e-6)
    assert "evenly spaced" in result.warnings[0]
    with pytest.raises(
        PatchfemError, match=r"loop.csv:1: law 'tanh' needs the times of the rows of this record"
    ):
        fit_measurement(load_scene(tmp_path, "tanh"), loop, free_ranges("friction.static"))


# ---- the fit command


@pytest.fixture
def fit_command(tmp_path):
    """Return the words of a fit command for a noisy loop, with its files written."""
    time, slide = sine_path(24)
    force = elastic_plastic_force(slide, 0.31 * LOAD, 2.3e-6)
    force += 0.1 * np.random.default_rng(1).normal(size=49)
    write_loop(tmp_path / "loop.csv", time, slide, force, 1 + (np.arange(49) > 24))
    load_scene(tmp_path, "elastic-plastic", slide='[slide]\nkind = "file"\nfile = "loop.csv"\n')
    return ["fit", tmp_path / "scene.toml", "--to", tmp_path / "loop.csv", "-o", tmp_path / "out"]


def test_exact_fitted_scene_reproduces_fitted_loop(tmp_path, fit_command):
    """A run of the fitted scene, whose path file is the measured loop, agrees with the fitted rows."""
    free = "friction.static=0.1..0.7,friction.bond_length=0.3 um..20 um"
    result = run_successfully(*fit_command, "--free", free, "--hold", "cycle=2", "--json").content
    assert result == read_json(tmp_path / "out/fit.json")
    static = result["values"]["friction.static"]
    assert static["low"] < 0.31 < static["high"]
    assert result["held"] == 24
    scene = load(tmp_path / "out/scene.fitted.toml")
    assert scene.friction.static == static["value"] and scene.slide.file == "../loop.csv"
    run = bench.run_bench(build(scene), None, 400)
    written = read_loop(tmp_path / "out/fit.csv")
    at = [np.argmin(np.abs(run.time - t)) for t in written.time]
    fitted = np.array(written.labels["fitted"], float)
    assert run.force[at] == pytest.approx(fitted, abs=1e-9)
    measures = read_json(tmp_path / "out/summary.json")["measures"]
    for name, force in (("work_measured", written.reading), ("work_fitted", fitted)):
        work = np.trapezoid(force[:25], written.displacement[:25])
        assert measures[name]["value"] == pytest.approx(work, rel=1e-12)


def test_always_unconverged_fit_exits_with_code_3(fit_command, monkeypatch, tmp_path):
    """A fit that reaches its limit of evaluations exits with code 3 and states that it did not converge."""
    from patchfem.identify import descent

    monkeypatch.setattr(descent, "MAX_DESCENT_EVALUATIONS", 1)
    assert (
        run_cli(
            *fit_command, "--free", "friction.static=0.1..0.7,friction.bond_length=0.3 um..20 um"
        ).code
        == 3
    )
    assert read_json(tmp_path / "out/fit.json")["outcome"] == "not_converged"


@pytest.mark.parametrize("free, message", [
    ("friction.static=0.6..0.1", "friction.static: 0.6..0.1: the low bound must lie below the high bound"),
    ("friction.static=0.1..nan", "a plain number is needed, not nan"),
    ("friction.static=-0.1..1", "friction.static: must be >= 0, not -0.1"), ("friction.law=1..2", "is not a number "
                                                                                                  "that can vary"),
    ("friction.bond_length=1..2", "a bare number without a unit"), ("friction.statc=0..1", "did you mean 'static'?"),
    ("friction.static", "write table.key=low..high"),
    ("x=1..2", "unknown key; known here"), ("frction.static=0..1", "did you mean 'friction'?"),
    ("friction.static=0..1,friction.static=0..2", "friction.static: is given twice"),
    ("contact.load=1 N..2 N", "[contact] and [normal] exclude"),
])  # fmt: skip
def test_refuses_invalid_range_of_parameter(fit_command, free, message, tmp_path):
    """An invalid range of `--free` is refused with the reason, and no file is written."""
    answer = run_cli(*fit_command, "--free", free)
    assert answer.code == 2 and message in answer.err and not (tmp_path / "out").exists()


HEAD = "time [s],displacement [um],force [N]\n"
BODY = "0,0,0\n1,1,1\n2,2,1\n3,3,1\n4,4,1\n"


@pytest.mark.parametrize("text, message", [
    ("", ":1: a header like"), (HEAD, ":1: a measured loop needs at least two rows"),
    ("time [s],displacement [um]\n" + "0,0\n1,1\n", ":1: no column force"),
    ("time [s],displacement [um],force\n" + BODY, ":1: a header like `time [s],displacement [um],force [N]` is needed"),
    ("time [s],displacement [um],force [lb]\n" + BODY, ":1: force [lb]: unknown unit; use one of N, kN, lbf"),
    ("displacement [um],force [N],friction_ratio\n0,0,0\n1,1,1\n", ":1: there are columns force and friction_ratio"),
    (HEAD + "0,0,0\n1,1\n", ":3: the number of cells must be 3 (time, displacement, force), not 2 as in '1,1'"),
    (HEAD + "0,5,0\n1,5,1\n", "displacement is the same in every row"),
    (HEAD + "0,0,0\n1,5,0\n", "force is 0 in every row"), (HEAD + "0,0,0\n1,5,1\n", "only 2 rows are used"),
])  # fmt: skip
def test_refuses_invalid_loop_with_line_number(fit_command, text, message, tmp_path):
    """An invalid table of a measured loop is refused with its file, line and reason."""
    (tmp_path / "loop.csv").write_text(text)
    answer = run_cli(
        *fit_command, "--free", "friction.static=0.1..0.7,friction.bond_length=0.3 um..20 um"
    )
    assert answer.code == 2 and "loop.csv" in answer.err and message in answer.err, answer.err


@pytest.mark.parametrize("text, selected", [("1", [0]), ("01", [0]), ("U", [2, 3])])
def test_exact_held_out_flags(text, selected):
    """Flags that are numbers are compared as numbers; others need only contain the text."""
    mask = select_held_out(f"flag={text}", Path("a.csv"), {"flag": ["1", "10", "U", "U*", ""]})
    assert np.flatnonzero(mask).tolist() == selected


def test_refuses_invalid_hold_options_and_scenes(fit_command, tmp_path):
    """Invalid options of `--hold`, missing files and unsuitable scenes are refused."""
    free = ["--free", "friction.static=0.1..0.7"]
    for words, code, message in (
        (
            ["--hold", "cycle=3"],
            2,
            "--hold cycle=3: none of the rows of loop.csv with a reading has",
        ),
        (
            ["--hold", "run=3"],
            2,
            "no column run by which rows can be held out or left out; use cycle",
        ),
        (["--hold", "cycle"], 2, "column=value,value"),
        (["--hold", "cycle=1,2"], 2, "only 0 rows are"),
    ):
        answer = run_cli(*fit_command, *free, *words)
        assert answer.code == code and message in answer.err, answer.err
    assert run_cli(*fit_command[:3], tmp_path / "none.csv", *free).code == 4
    (tmp_path / "scene.toml").write_text(
        POINT + LAWS["coulomb"].replace("0.5", "-1") + SINE, "utf-8"
    )
    assert "friction.static: must be >= 0" in run_cli(*fit_command, *free).err
    with pytest.raises(SceneError, match="but this is a patch scene"):
        text = (
            '[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\nload = "80 N"\nsubstrate = '
            '"Ti-8Al-1Mo-1V"\n'
        )
        LoopComparison(loads(text), tmp_path / "loop.csv", [])


def test_exact_rest_speed_of_measured_motion_is_written(tmp_path):
    """The fitted scene states the rest speed, a thousandth of the largest measured speed; a warning states its step error.

    The scene leaves the rest speed v_h out, so that it follows from the motion.
    """
    time, slide = sine_path(12, 1)
    scene = load_scene(tmp_path, "growth", "friction.rest_speed=1 m/s")
    scene = loads(
        scene.text.replace('rest_speed = "0.01 mm/s"\n', ""),
        tmp_path / "scene.toml",
        ["accuracy.steps_per_cycle=12"],
    )
    loop = write_loop(
        tmp_path / "loop.csv", time, slide, elastic_plastic_force(slide, 0.31 * LOAD, 2.3e-6)
    )
    result = fit_measurement(scene, loop, free_ranges("friction.static"))
    change = result.comparison.step_error / np.abs(result.comparison.measured).max()
    assert f"changes by {change:.1g} of its peak" in result.warnings[-1]
    speed = np.abs(np.diff(slide) / np.diff(time)).max()
    text = format_fitted_scene(result, ["Fitted.", "Two."], tmp_path)
    assert math.isclose(loads(text).friction.rest_speed, 1e-3 * speed, rel_tol=1e-9)
    assert text.startswith("# Fitted.\n# Two.\n")
