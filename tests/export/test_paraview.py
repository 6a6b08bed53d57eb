"""Exported scripts for ParaView, run with VTK filters in its place, draw what the figures of patchfem draw."""

from __future__ import annotations

import os
import runpy
import shutil
import subprocess
import sys
import types

import matplotlib.pyplot as plt
import numpy as np
import pytest
from command_line import run_cli
from exported import write_small_series
from paraview_stand_in import SimpleModule, compute_blocks, read_frames

from patchfem.export.drawing.film import make_film
from patchfem.export.drawing.panels import upper_piece_slide
from patchfem.export.fields.blocks import NAMES
from patchfem.export.fields.series import Series


def run_script(path, monkeypatch, *arguments, kind=None) -> SimpleModule:
    """Run a script as `pvpython PATH ARGUMENTS`; kind is the class of render windows without a display."""
    simple = SimpleModule()
    package = types.ModuleType("paraview")
    package.simple = simple
    for name, module in (("paraview", package), ("paraview.simple", simple)):
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(sys, "argv", [str(path), *arguments])
    if kind is None:
        monkeypatch.setenv("DISPLAY", ":0")
    else:
        monkeypatch.delenv("DISPLAY", raising=False)
        core = types.SimpleNamespace(
            vtkRenderWindow=lambda: types.SimpleNamespace(GetClassName=lambda: kind)
        )
        monkeypatch.setitem(sys.modules, "vtkmodules.vtkRenderingCore", core)
    runpy.run_path(str(path))
    return simple


@pytest.fixture(scope="module")
def script_file(bench_folder, tmp_path_factory):
    """Return the script of a bench, in a folder whose name contains quotes."""
    folder = tmp_path_factory.mktemp('it\'s a "run"')
    answer = run_cli("export", bench_folder, "-o", folder / "the 'last'.py")
    assert answer.code == 0, answer.err
    assert "the 'last'.pvd and the 'last'_frames beside it" in answer.out
    return folder / "the 'last'.py"


@pytest.mark.slow
def test_exact_paraview_positions_agree_with_figures(bench_folder, script_file, monkeypatch):
    """The deformed positions of the script agree with those of the figures within 1e-6 of the length.

    Displacements, slides and cell data agree to the last bit.
    """
    simple = run_script(script_file, monkeypatch)
    (pieces, _), (interface, _), (clock, _) = simple.shown
    files = read_frames(clock.Input)
    with Series(bench_folder) as series:
        settings = make_film(series)
        assert [time for time, _ in files] == [series.times[number] for number in settings.numbers]
        for number, (_, file) in list(zip(settings.numbers, files))[::4]:
            frame = series.frame(number)
            expected = settings.panels(frame)[0].places * 1e-3
            blocks = compute_blocks(pieces, file) + compute_blocks(interface, file)
            assert len(blocks) == len(NAMES)
            assert (
                np.abs(np.concatenate([points[:, :2] for points, *_ in blocks]) - expected).max()
                <= 1e-6 * 12.7e-3
            )
            for (_, point_data, cell_data), block in zip(blocks, frame.blocks.values()):
                assert np.array_equal(point_data["displacement"], block.point_data["displacement"])
                upper = block is frame.blocks["upper"]
                assert np.array_equal(
                    np.unique(point_data["slide"][:, 0]),
                    np.float32([upper * upper_piece_slide(frame)]),
                )
                for name, values in block.cell_data.items():
                    assert np.array_equal(cell_data[name], values)


@pytest.mark.share(1)
@pytest.mark.parametrize("component, index", [("sigma_yy", 1), ("tau_xy", 3)])
def test_exact_script_colours_stress_component(
    bench_folder, tmp_path, monkeypatch, component, index
):
    """A script colours a stress component in MPa over a range that is symmetric about zero.

    The pressure on the interface has the range of all frames, and the light changes neither colour.
    """
    assert run_cli("export", bench_folder, "-o", tmp_path / "play.py", "--of", component).code == 0
    simple = run_script(tmp_path / "play.py", monkeypatch)
    (pieces, _), (_, line), (clock, _) = simple.shown
    ranges = {
        name: [
            range_arguments
            for word, *range_arguments in table.called
            if word == "RescaleTransferFunction"
        ]
        for name, table in simple.tables.items()
    }
    ((low, high),) = ranges["shown"]
    assert low == -high and high > 0 and "motion and gap x " in clock.Format
    files = read_frames(clock.Input)
    with Series(bench_folder) as series:
        frames = [series.frame(number) for number in make_film(series).numbers]
    for (_, _, cells), block in zip(
        compute_blocks(pieces, files[0][1]), (frames[0].blocks["lower"], frames[0].blocks["upper"])
    ):
        assert cells["shown"] == pytest.approx(1e-6 * block.cell_data["stress"][:, index], rel=1e-6)
    pressures = [frame.blocks["interface"].point_data["normal_stress"].max() for frame in frames]
    assert ranges["contact_pressure"] == [[0.0, 1e-6 * max(pressures)]]
    assert simple.coloured[id(line)] == ("POINTS", "contact_pressure")
    table = simple.tables["contact_pressure"]
    assert table.AutomaticRescaleRangeMode == "Never"
    assert simple.bars[id(table)].ComponentTitle == "[MPa]"
    assert (line.Ambient, line.Diffuse) == (1.0, 0.0)


def test_refuses_unknown_stress_component(bench_folder, tmp_path):
    """An unknown stress component is refused, and so is a component for a file other than a script."""
    unknown = run_cli("export", bench_folder, "-o", tmp_path / "play.py", "--of", "sigma")
    assert unknown.code == 2 and "the stresses are von_mises, sigma_xx" in unknown.err
    table = run_cli("export", bench_folder, "-o", tmp_path / "a.csv", "--of", "tau_xy")
    assert table.code == 2 and "-o play.py" in table.err and not list(tmp_path.iterdir())


def test_exact_script_plays_or_saves_cycle(script_file, tmp_path, monkeypatch):
    """A script plays the last cycle three times, or saves its pictures, from any working directory."""
    monkeypatch.chdir(tmp_path)
    simple = run_script(script_file, monkeypatch)
    assert simple.scene.PlayMode == "Snap To TimeSteps" and not simple.saved
    assert [name for (name,) in simple.scene.called] == [
        "UpdateAnimationUsingDataTimeSteps",
        "GoToFirst",
        *3 * ["Play"],
    ]
    simple = run_script(script_file, monkeypatch, "cycle.png")
    assert simple.saved == [("cycle.png", 7)] and ("Play",) not in simple.scene.called
    assert not os.listdir(tmp_path)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems need no DISPLAY")
def test_refuses_script_without_display(script_file, monkeypatch):
    """Without a display a script stops with a message instead of signal 11; EGL and OSMesa need no display."""
    with pytest.raises(SystemExit, match=r"no display.*xvfb-run -a pvpython"):
        run_script(script_file, monkeypatch, "cycle.png", kind="vtkXOpenGLRenderWindow")
    assert run_script(script_file, monkeypatch, "cycle.png", kind="vtkEGLRenderWindow").saved == [
        ("cycle.png", 7)
    ]


def test_refuses_script_without_fields_or_motion(bench_folder, script_file, tmp_path, monkeypatch):
    """A script without its field files, and scripts of results without fields or motion, are refused."""
    (tmp_path / "alone.py").write_text(script_file.read_text("utf-8"), "utf-8")
    with pytest.raises(SystemExit, match="does not exist"):
        run_script(tmp_path / "alone.py", monkeypatch)
    write_small_series(tmp_path / "still", 1)
    answer = run_cli("export", tmp_path / "still", "-o", tmp_path / "a.py")
    assert answer.code == 2 and "no motion to show" in answer.err
    answer = run_cli("export", bench_folder, "-o", tmp_path / "a.py", "--frame", "1")
    assert answer.code == 2 and "--frame" in answer.err
    (tmp_path / "lumped").mkdir()
    answer = run_cli("export", tmp_path / "lumped", "-o", tmp_path / "a.py")
    assert answer.code == 4 and "only a run with [contact] writes one" in answer.err
    answer = run_cli("export", bench_folder, "-o", tmp_path / "alone.py" / "a.py")
    assert answer.code == 4 and "cannot be written" in answer.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["alone.py", "lumped", "still"]


@pytest.mark.slow
@pytest.mark.skipif(
    shutil.which("pvpython") is None or not ("DISPLAY" in os.environ or shutil.which("xvfb-run")),
    reason="no ParaView here, or nothing that it could draw on",
)
def test_always_paraview_draws_every_frame(bench_folder, tmp_path):
    """ParaView draws a picture of each frame with moving pieces and two colour scales, and reads .vtu and .pvd files."""
    answer = run_cli("export", bench_folder, "-o", tmp_path / "cycle.py")
    assert (
        answer.code == 0 and run_cli("export", bench_folder, "-o", tmp_path / "all.pvd").code == 0
    )
    screen = [] if "DISPLAY" in os.environ else ["xvfb-run", "-a"]
    subprocess.run(
        [*screen, "pvpython", "cycle.py", "cycle.png"], cwd=tmp_path, check=True, timeout=300
    )
    with Series(bench_folder) as series:
        count = len(make_film(series).numbers)
        n_frames = len(series)
    pictures = [plt.imread(path)[..., :3] for path in sorted(tmp_path.glob("cycle.*.png"))]
    assert len(pictures) == count and all(picture.shape == (800, 1280, 3) for picture in pictures)
    background = pictures[0][700, 100]
    is_drawn = [np.abs(picture - background).max(axis=-1) > 0.05 for picture in pictures]
    assert all(0.1 < picture[:, 200:1100].mean() < 0.8 for picture in is_drawn)
    # both colour scales are drawn
    assert all(picture[:300, 1150:].any() and picture[500:, 1150:].any() for picture in is_drawn)
    assert max((picture != is_drawn[0]).sum() for picture in is_drawn) > 1000
    script = (
        "from paraview import simple; r = simple.PVDReader(FileName='all.pvd'); r.UpdatePipeline(); "
        "print(len(r.TimestepValues), r.GetDataInformation().GetNumberOfCells())"
    )
    printed = subprocess.run(
        [*screen, "pvpython", "-c", script],
        cwd=tmp_path,
        check=True,
        timeout=300,
        capture_output=True,
        text=True,
    ).stdout.split()
    with Series(bench_folder) as series:
        assert printed == [str(n_frames), str(len(series.frame(0).types))]
