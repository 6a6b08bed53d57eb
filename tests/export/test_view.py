"""Pictures of the pressed pieces: what is drawn is what was computed, without OpenGL, or a named refusal."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from command_line import cli
from exported import at, write_small
from hypothesis import given
from hypothesis import strategies as st

from patchfem.export.drawing import view
from patchfem.export.drawing.flat import Picture
from patchfem.export.drawing.panels import (
    cell_areas,
    drawn_displacement,
    interface_curves,
    make_panels,
    outer_edges,
    round_down_factor,
    upper_piece_slide,
)
from patchfem.export.fields.series import Series

# Modules that stand in for pyvista where OpenGL does not work; the child process that draws a test picture imports them.
ABORTS = "import os; os.abort()"
HANGS = "import time; time.sleep(600)"
FAILS = "raise RuntimeError('no device')"


def frame_of(folder, number=-1):
    with Series(folder) as series:
        return series.frame(number)


@pytest.mark.parametrize("magnify", [None, 0.0, 1.0, 2500.0])
def test_exact_the_drawn_gap_is_the_gap_times_the_factor(bench, magnify):
    frame = frame_of(bench)
    line = frame.interface()
    upper = np.unique(np.concatenate([block.ravel() for block in frame.cells(1)]))
    face = upper[frame.points[upper, 1] == 0]
    for panel in make_panels(frame, magnify):
        assert magnify is None or panel.factor == magnify
        drawn = panel.places[face, 1] - panel.places[line, 1]
        wanted = panel.factor * 1e3 * frame.point_data["gap"][line]
        assert np.abs(drawn - wanted).max() <= 1e-6 * (wanted.max() + 1e-3 * panel.factor)
        far = frame.points[:, 1] == frame.points[:, 1].max()
        move = frame.point_data["displacement"][far, :2]
        slide = np.array([upper_piece_slide(frame), 0.0])  # as it is, the rest magnified
        drawn = (
            frame.points[far, :2] + min(panel.factor, 1.0) * slide + panel.factor * (move - slide)
        )
        assert panel.places[far] == pytest.approx(1e3 * drawn, rel=1e-6)
        assert f"{panel.factor:g} times" in panel.title() or panel.factor == 0


@pytest.mark.parametrize("slide", [0.0, 15e-6, -40e-6])
def test_exact_a_slide_is_found_and_not_magnified(bench, slide):
    """A rigid slide and rotation about the origin, of the size of a rig's run, on top of the pressed pair."""
    still = frame_of(bench, 0)
    upper = np.unique(np.concatenate([block.ravel() for block in still.cells(1)]))
    move = still.point_data["displacement"].astype(float)
    move[upper, 0] += slide - 1e-5 * still.points[upper, 1]
    move[upper, 1] += 1e-5 * still.points[upper, 0]
    frame = replace(still, point_data=still.point_data | {"displacement": move})
    assert upper_piece_slide(frame) == pytest.approx(slide + upper_piece_slide(still), abs=1e-12)
    for panel in make_panels(frame):
        assert panel.factor > 10
        aside = panel.places[upper, 0] - 1e3 * frame.points[upper, 0]
        bent = panel.factor * 1e3 * np.abs(drawn_displacement(frame)[upper, 0] - slide).max()
        assert np.abs(aside).max() <= 1e3 * abs(slide) + bent * (1 + 1e-9)
        assert np.abs(aside).max() < 0.1 * 12.7
        assert ("the slide of" in panel.title()) == (slide != 0)


def test_exact_panels_show_the_pieces_and_scale_to_their_stress(bench):
    frame = frame_of(bench)
    whole, close = make_panels(frame)
    mises = frame.cell_data["von_mises"]
    assert whole.cells.sum() == (frame.cell_data["part"] < 2).sum()
    assert close.cells.sum() < whole.cells.sum()
    assert close.top == whole.top >= mises[close.cells].max() and not close.over
    size = cell_areas(frame)
    assert size.sum() == pytest.approx(2 * 12.7e-3 * 6.35e-3, rel=1e-9)
    assert whole.top == np.nanmax(mises) and not whole.over
    sharp = mises.copy()
    sharp[np.argmax(np.nan_to_num(mises))] *= 30  # one small cell that would darken all the rest
    spiky, beside = make_panels(replace(frame, cell_data=frame.cell_data | {"von_mises": sharp}))
    # one scale: 4.8 MPa once stood for the colour that was 8.85 MPa beside it
    assert beside.top == spiky.top
    above = size[whole.cells & (sharp > spiky.top)].sum()
    assert spiky.over and spiky.top <= np.nanmax(mises) and "or more" in spiky.title()
    assert 0 < above <= 0.005 * size.sum()
    drawn = Picture(frame, "a", (spiky, beside), (18, 10))
    assert sum("von Mises" in axes.get_ylabel() for axes in drawn.figure.axes) == 1
    assert len({cells.get_clim() for bodies in drawn.bodies for _, _, cells in bodies.cells}) == 1
    outer, inner = outer_edges(frame, whole.cells)
    reach = np.linalg.norm(np.diff(frame.points[outer], axis=1), axis=2).sum()
    assert reach == pytest.approx(4 * (12.7e-3 + 6.35e-3), rel=1e-9)
    assert np.abs(np.abs(frame.points[inner][..., 1]) - 152.4e-6).max() <= 1e-12
    assert np.linalg.norm(np.diff(frame.points[inner], axis=1), axis=2).sum() == pytest.approx(
        2 * 12.7e-3, rel=1e-9
    )
    x, shown, unit = interface_curves(frame)
    assert unit == "MPa" and [label for label, _ in shown] == ["normal stress", "shear stress"]
    share = np.convolve(np.diff(x), [0.5, 0.5])
    # MPa mm mm = N
    assert share @ shown[0][1] * 12.7 == pytest.approx(26 * 4.4482216152605, rel=1e-6)


def test_exact_any_cells_are_drawn_whole(tmp_path):
    given_ = write_small(tmp_path / "out")
    frame = frame_of(tmp_path / "out")
    assert cell_areas(frame).sum() == pytest.approx(2 * 2e-3 * 1e-3, rel=1e-9)
    outer, _ = outer_edges(frame, make_panels(frame)[0].cells)
    assert np.linalg.norm(np.diff(frame.points[outer], axis=1), axis=2).sum() == pytest.approx(
        4 * 3e-3, rel=1e-9
    )
    mises = [at(given_.blocks[side].cell_data["von_mises"], 2) for side in ("lower", "upper")]
    assert np.array_equal(frame.cell_data["von_mises"][:14], np.concatenate(mises))


@given(st.floats(1e-3, 1e12))
def test_always_the_factor_is_round_and_just_below(factor):
    found = round_down_factor(factor, 0.0)
    assert factor / 2.5 * (1 - 1e-9) <= found <= factor * (1 + 1e-9)
    lead = found / 10.0 ** np.floor(np.log10(found * (1 + 1e-9)))
    assert min(abs(lead - step) for step in (1, 2, 5)) <= 1e-9
    assert round_down_factor(factor) == max(1.0, round_down_factor(factor))


@pytest.mark.slow
def test_exact_the_window_shows_the_pieces_where_opengl_draws(bench):
    if why := view.explain_missing_opengl():
        pytest.skip(why)
    drawn = view.make_plotter(frame_of(bench), "a", None, off_screen=True).screenshot(
        None, return_img=True
    )
    assert drawn.shape == (1000, 1800, 3)
    assert (np.ptp(drawn.astype(float), axis=2) > 25).mean() > 0.15


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have a screen without DISPLAY")
def test_refuses_a_window_without_a_screen(bench, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    answer = cli("view", bench)
    assert answer.code == 4 and "no screen" in answer.err and "-o FILE.png" in answer.err


@pytest.mark.share(0, 1)
@pytest.mark.parametrize(
    "stand_in, says", [(ABORTS, "signal 6"), (FAILS, "no device"), (HANGS, "more than 60 s")]
)
def test_refuses_a_window_without_opengl_and_says_why(bench, tmp_path, monkeypatch, stand_in, says):
    (tmp_path / "pyvista.py").write_text(stand_in)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("DISPLAY", ":99")
    answer = cli("view", bench)
    assert answer.code == 4 and "no working OpenGL" in answer.err and says in answer.err
    assert "-o FILE.png" in answer.err


@pytest.mark.parametrize(
    "words, code, says",
    [
        (["-o", "a.bmp"], 2, ".png, .svg, .pdf"),
        (["-o", "a.svg", "--frame", "999"], 2, "--frame"),
        (["-o", "a.svg", "--magnify", "-1"], 2, "--magnify"),
        (["-o", "a.svg", "--magnify", "nan"], 2, "--magnify"),
        (["-o", "nowhere/x/a.svg", "--frame", "999"], 2, "--frame"),
    ],
)
def test_refuses_pictures_by_name(bench, tmp_path, monkeypatch, words, code, says):
    monkeypatch.chdir(tmp_path)
    answer = cli("view", bench, *words)
    assert answer.code == code and says in answer.err
    assert not list(tmp_path.iterdir())
