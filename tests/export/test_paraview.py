"""A script for ParaView, run on a stand-in whose filters are VTK's: what it would draw is what pictures draw."""

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
from command_line import cli
from exported import write_small
from paraview_stand_in import Simple, blocks_at, times_and_files

from patchfem.export.drawing.film import make_film_settings
from patchfem.export.drawing.panels import upper_piece_slide
from patchfem.export.fields.blocks import NAMES
from patchfem.export.fields.series import Series


def played(path, monkeypatch, *words, kind=None) -> Simple:
    """The script run as `pvpython PATH WORDS`; kind: of the windows of a ParaView that has no display."""
    simple = Simple()
    package = types.ModuleType("paraview")
    package.simple = simple
    for name, module in (("paraview", package), ("paraview.simple", simple)):
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(sys, "argv", [str(path), *words])
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
def written(bench, tmp_path_factory):
    """The script of a bench, in a folder whose name needs care."""
    folder = tmp_path_factory.mktemp('it\'s a "run"')
    answer = cli("export", bench, "-o", folder / "the 'last'.py")
    assert answer.code == 0, answer.err
    assert "the 'last'.pvd and the 'last'_frames beside it" in answer.out
    return folder / "the 'last'.py"


@pytest.mark.slow
def test_exact_paraview_warps_to_the_places_that_pictures_draw(bench, written, monkeypatch):
    simple = played(written, monkeypatch)
    (pieces, _), (interface, _), (clock, _) = simple.shown
    files = times_and_files(clock.Input)
    with Series(bench) as series:
        film = make_film_settings(series)
        assert [time for time, _ in files] == [series.times[number] for number in film.numbers]
        for number, (_, file) in list(zip(film.numbers, files))[::4]:
            frame = series.frame(number)
            wanted = film.panels(frame)[0].places * 1e-3
            got = blocks_at(pieces, file) + blocks_at(interface, file)
            assert len(got) == len(NAMES)
            assert (
                np.abs(np.concatenate([points[:, :2] for points, *_ in got]) - wanted).max()
                <= 1e-6 * 12.7e-3
            )
            for (_, point_data, cell_data), block in zip(got, frame.blocks.values()):
                assert np.array_equal(point_data["displacement"], block.point_data["displacement"])
                upper = block is frame.blocks["upper"]
                assert np.array_equal(
                    np.unique(point_data["slide"][:, 0]),
                    np.float32([upper * upper_piece_slide(frame)]),
                )
                for name, values in block.cell_data.items():
                    assert np.array_equal(cell_data[name], values)


@pytest.mark.share(1)
@pytest.mark.parametrize("of, place", [("sigma_yy", 1), ("tau_xy", 3)])
def test_exact_a_script_colours_a_component_in_megapascal(bench, tmp_path, monkeypatch, of, place):
    """As far below 0 as above, whatever its sign; the script names it and the factors of the motion. The pressure on
    the interface has the range of all frames, and neither colour depends on the light."""
    assert cli("export", bench, "-o", tmp_path / "play.py", "--of", of).code == 0
    simple = played(tmp_path / "play.py", monkeypatch)
    (pieces, _), (_, line), (clock, _) = simple.shown
    ranges = {
        name: [words for word, *words in table.called if word == "RescaleTransferFunction"]
        for name, table in simple.tables.items()
    }
    ((low, high),) = ranges["shown"]
    assert low == -high and high > 0 and "motion and gap x " in clock.Format
    files = times_and_files(clock.Input)
    with Series(bench) as series:
        frames = [series.frame(number) for number in make_film_settings(series).numbers]
    for (_, _, cells), block in zip(
        blocks_at(pieces, files[0][1]), (frames[0].blocks["lower"], frames[0].blocks["upper"])
    ):
        assert cells["shown"] == pytest.approx(1e-6 * block.cell_data["stress"][:, place], rel=1e-6)
    pressures = [frame.blocks["interface"].point_data["normal_stress"].max() for frame in frames]
    assert ranges["contact_pressure"] == [[0.0, 1e-6 * max(pressures)]]
    assert simple.coloured[id(line)] == ("POINTS", "contact_pressure")
    table = simple.tables["contact_pressure"]
    assert table.AutomaticRescaleRangeMode == "Never"
    assert simple.bars[id(table)].ComponentTitle == "[MPa]"
    assert (line.Ambient, line.Diffuse) == (1.0, 0.0)


def test_exact_a_script_shows_where_the_interface_sticks_and_slips(bench, tmp_path, monkeypatch):
    assert cli("export", bench, "-o", tmp_path / "play.py", "--of", "status").code == 0
    simple = played(tmp_path / "play.py", monkeypatch)
    _, (line, display), (clock, _) = simple.shown
    assert simple.coloured[id(display)] == ("POINTS", "status") and display.LineWidth == 6
    table = simple.tables["status"]
    assert table.Annotations == ["0", "open", "1", "sticks", "2", "slips"]
    assert len(table.IndexedColors) == 9
    files = times_and_files(clock.Input)
    seen = set()
    with Series(bench) as series:
        for (_, file), number in zip(files, make_film_settings(series).numbers):
            known = series.frame(number).blocks["interface"].point_data["status"]
            ((_, points, _),) = blocks_at(line, file)
            assert points["status"].tolist() == known.tolist()
            seen |= set(known.tolist())
    assert {1, 2} <= seen <= {0, 1, 2}


def test_refuses_a_stress_that_is_none(bench, tmp_path):
    wrong = cli("export", bench, "-o", tmp_path / "play.py", "--of", "sigma")
    assert wrong.code == 2 and "the stresses are von_mises, sigma_xx" in wrong.err
    other = cli("export", bench, "-o", tmp_path / "a.csv", "--of", "tau_xy")
    assert other.code == 2 and "-o play.py" in other.err and not list(tmp_path.iterdir())


def test_exact_paraview_plays_or_writes_the_cycle_from_any_folder(written, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    simple = played(written, monkeypatch)
    assert simple.scene.PlayMode == "Snap To TimeSteps" and not simple.saved
    assert [name for (name,) in simple.scene.called] == [
        "UpdateAnimationUsingDataTimeSteps",
        "GoToFirst",
        *3 * ["Play"],
    ]
    simple = played(written, monkeypatch, "cycle.png")
    assert simple.saved == [("cycle.png", 7)] and ("Play",) not in simple.scene.called
    assert not os.listdir(tmp_path)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems need no DISPLAY")
def test_refuses_to_crash_where_there_is_no_display(written, monkeypatch):
    """ParaView's windows for X end by signal 11 there; those for EGL and OSMesa need none."""
    with pytest.raises(SystemExit, match=r"no display.*xvfb-run -a pvpython"):
        played(written, monkeypatch, "cycle.png", kind="vtkXOpenGLRenderWindow")
    assert played(written, monkeypatch, "cycle.png", kind="vtkEGLRenderWindow").saved == [
        ("cycle.png", 7)
    ]


def test_refuses_a_script_without_its_fields_or_of_nothing_that_moves(
    bench, written, tmp_path, monkeypatch
):
    (tmp_path / "alone.py").write_text(written.read_text("utf-8"), "utf-8")
    with pytest.raises(SystemExit, match="does not exist"):
        played(tmp_path / "alone.py", monkeypatch)
    write_small(tmp_path / "still", 1)
    answer = cli("export", tmp_path / "still", "-o", tmp_path / "a.py")
    assert answer.code == 2 and "no motion to show" in answer.err
    answer = cli("export", bench, "-o", tmp_path / "a.py", "--frame", "1")
    assert answer.code == 2 and "--frame" in answer.err
    (tmp_path / "lumped").mkdir()
    answer = cli("export", tmp_path / "lumped", "-o", tmp_path / "a.py")
    assert answer.code == 4 and "only a run with [contact] writes one" in answer.err
    answer = cli("export", bench, "-o", tmp_path / "alone.py" / "a.py")
    assert answer.code == 4 and "cannot be written" in answer.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["alone.py", "lumped", "still"]


@pytest.mark.slow
@pytest.mark.skipif(
    shutil.which("pvpython") is None or not ("DISPLAY" in os.environ or shutil.which("xvfb-run")),
    reason="no ParaView here, or nothing that it could draw on",
)
def test_always_paraview_itself_draws_every_frame_of_the_cycle(bench, tmp_path):
    """A picture per frame: background, both colour scales, and pieces that move; .vtu and .pvd open with every time."""
    answer = cli("export", bench, "-o", tmp_path / "cycle.py")
    assert answer.code == 0 and cli("export", bench, "-o", tmp_path / "all.pvd").code == 0
    screen = [] if "DISPLAY" in os.environ else ["xvfb-run", "-a"]
    subprocess.run(
        [*screen, "pvpython", "cycle.py", "cycle.png"], cwd=tmp_path, check=True, timeout=300
    )
    with Series(bench) as series:
        count = len(make_film_settings(series).numbers)
        every = len(series)
    drawn = [plt.imread(path)[..., :3] for path in sorted(tmp_path.glob("cycle.*.png"))]
    assert len(drawn) == count and all(one.shape == (800, 1280, 3) for one in drawn)
    ground = drawn[0][700, 100]
    inside = [np.abs(one - ground).max(axis=-1) > 0.05 for one in drawn]
    assert all(0.1 < one[:, 200:1100].mean() < 0.8 for one in inside)
    # the scales of both colours
    assert all(one[:300, 1150:].any() and one[500:, 1150:].any() for one in inside)
    assert max((one != inside[0]).sum() for one in inside) > 1000
    asked = (
        "from paraview import simple; r = simple.PVDReader(FileName='all.pvd'); r.UpdatePipeline(); "
        "print(len(r.TimestepValues), r.GetDataInformation().GetNumberOfCells())"
    )
    said = subprocess.run(
        [*screen, "pvpython", "-c", asked],
        cwd=tmp_path,
        check=True,
        timeout=300,
        capture_output=True,
        text=True,
    ).stdout.split()
    with Series(bench) as series:
        assert said == [str(every), str(len(series.frame(0).types))]
