"""Figures of the pressed pieces: they agree with the computed fields, without OpenGL, or are refused."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from unittest.mock import MagicMock

import numpy as np
import pytest
from command_line import run_cli
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

# Modules imported in place of PyVista where OpenGL does not work, by the process that draws a test
# picture.
ABORTS = "import os; os.abort()"
HANGS = "import time; time.sleep(600)"
FAILS = "raise RuntimeError('no device')"


def read_frame(folder, number=-1):
    """Return a frame of a results folder."""
    with Series(folder) as series:
        return series.frame(number)


@pytest.mark.parametrize("magnify", [None, 0.0, 2500.0])
def test_exact_drawn_gap_is_magnified_gap(bench_folder, magnify):
    """The drawn gap is the computed gap times the magnification; the slide of the upper piece is not magnified."""
    frame = read_frame(bench_folder)
    line = frame.interface()
    upper = np.unique(np.concatenate([block.ravel() for block in frame.cells(1)]))
    interface_nodes = upper[frame.points[upper, 1] == 0]
    for panel in make_panels(frame, magnify):
        assert magnify is None or panel.factor == magnify
        drawn = panel.places[interface_nodes, 1] - panel.places[line, 1]
        expected = panel.factor * 1e3 * frame.point_data["gap"][line]
        assert np.abs(drawn - expected).max() <= 1e-6 * (expected.max() + 1e-3 * panel.factor)
        is_far_face = frame.points[:, 1] == frame.points[:, 1].max()
        move = frame.point_data["displacement"][is_far_face, :2]
        # the slide is not magnified, but all other motion is
        slide = np.array([upper_piece_slide(frame), 0.0])
        drawn = (
            frame.points[is_far_face, :2]
            + min(panel.factor, 1.0) * slide
            + panel.factor * (move - slide)
        )
        assert panel.places[is_far_face] == pytest.approx(1e3 * drawn, rel=1e-6)
        assert f"{panel.factor:g} times" in panel.title() or panel.factor == 0


@pytest.mark.parametrize("slide", [0.0, -40e-6])
def test_exact_rigid_slide_is_not_magnified(bench_folder, slide):
    """A rigid slide and rotation added to the pressed pair are recognised and not magnified."""
    pressed = read_frame(bench_folder, 0)
    upper = np.unique(np.concatenate([block.ravel() for block in pressed.cells(1)]))
    move = pressed.point_data["displacement"].astype(float)
    move[upper, 0] += slide - 1e-5 * pressed.points[upper, 1]
    move[upper, 1] += 1e-5 * pressed.points[upper, 0]
    frame = replace(pressed, point_data=pressed.point_data | {"displacement": move})
    assert upper_piece_slide(frame) == pytest.approx(slide + upper_piece_slide(pressed), abs=1e-12)
    for panel in make_panels(frame):
        assert panel.factor > 10
        offset = panel.places[upper, 0] - 1e3 * frame.points[upper, 0]
        deformation = panel.factor * 1e3 * np.abs(drawn_displacement(frame)[upper, 0] - slide).max()
        assert np.abs(offset).max() <= 1e3 * abs(slide) + deformation * (1 + 1e-9)
        assert np.abs(offset).max() < 0.1 * 12.7
        assert ("the slide of" in panel.title()) == (slide != 0)


def test_exact_panels_share_stress_scale(bench_folder):
    """Both panels share one scale of stress, which a small singular cell does not change.

    Areas, edges and the load that the curves integrate to are those of the pieces.
    """
    frame = read_frame(bench_folder)
    overview, detail = make_panels(frame)
    mises = frame.cell_data["von_mises"]
    assert overview.cells.sum() == (frame.cell_data["part"] < 2).sum()
    assert detail.cells.sum() < overview.cells.sum()
    assert detail.top == overview.top >= mises[detail.cells].max() and not detail.is_cut
    areas = cell_areas(frame)
    assert areas.sum() == pytest.approx(2 * 12.7e-3 * 6.35e-3, rel=1e-9)
    assert overview.top == np.nanmax(mises) and not overview.is_cut
    singular = mises.copy()
    singular[np.argmax(np.nan_to_num(mises))] *= (
        30  # a single small cell must not darken all others
    )
    singular_overview, singular_detail = make_panels(
        replace(frame, cell_data=frame.cell_data | {"von_mises": singular})
    )
    # both panels have one scale; earlier one colour stood for 4.8 MPa in one and for 8.85 MPa in
    # the other
    assert singular_detail.top == singular_overview.top
    area_above = areas[overview.cells & (singular > singular_overview.top)].sum()
    assert (
        singular_overview.is_cut
        and singular_overview.top <= np.nanmax(mises)
        and "or more" in singular_overview.title()
    )
    assert 0 < area_above <= 0.005 * areas.sum()
    picture = Picture(frame, "a", (singular_overview, singular_detail), (18, 10))
    assert sum("von Mises" in axes.get_ylabel() for axes in picture.figure.axes) == 1
    assert len({cells.get_clim() for bodies in picture.bodies for _, _, cells in bodies.cells}) == 1
    outer, inner = outer_edges(frame, overview.cells)
    edge_length = np.linalg.norm(np.diff(frame.points[outer], axis=1), axis=2).sum()
    assert edge_length == pytest.approx(4 * (12.7e-3 + 6.35e-3), rel=1e-9)
    assert np.abs(np.abs(frame.points[inner][..., 1]) - 152.4e-6).max() <= 1e-12
    assert np.linalg.norm(np.diff(frame.points[inner], axis=1), axis=2).sum() == pytest.approx(
        2 * 12.7e-3, rel=1e-9
    )
    x, curves, unit = interface_curves(frame)
    assert unit == "MPa" and [label for label, _ in curves] == ["normal stress", "shear stress"]
    lengths = np.convolve(np.diff(x), [0.5, 0.5])
    # MPa mm mm is N
    assert lengths @ curves[0][1] * 12.7 == pytest.approx(26 * 4.4482216152605, rel=1e-6)


@given(st.floats(1e-3, 1e12))
def test_always_magnification_is_rounded_down(factor):
    """The magnification is rounded down to 1, 2 or 5 times a power of ten, by a factor of at most 2.5."""
    rounded = round_down_factor(factor, 0.0)
    assert factor / 2.5 * (1 - 1e-9) <= rounded <= factor * (1 + 1e-9)
    mantissa = rounded / 10.0 ** np.floor(np.log10(rounded * (1 + 1e-9)))
    assert min(abs(mantissa - step) for step in (1, 2, 5)) <= 1e-9
    assert round_down_factor(factor) == max(1.0, round_down_factor(factor))


def test_exact_first_panel_of_window_has_colour_bar(bench_folder, monkeypatch):
    """Of the panels of the window, the first one alone has the colour bar of the stress."""
    monkeypatch.setattr("pyvista.Plotter", MagicMock())
    calls = view.make_plotter(read_frame(bench_folder), "a", None).method_calls
    names = [name for name, _, _ in calls]
    first, second, _ = (k for k, name in enumerate(names) if name == "subplot")
    assert [calls[k].args for k in (first, second)] == [(0, 0), (0, 1)]
    assert names.count("add_scalar_bar") == names[first:second].count("add_scalar_bar") == 1


@pytest.mark.slow
def test_exact_window_shows_coloured_pieces(bench_folder):
    """With OpenGL the window shows the coloured pieces."""
    if reason := view.explain_missing_opengl():
        pytest.skip(reason)
    picture = view.make_plotter(read_frame(bench_folder), "a", None, off_screen=True).screenshot(
        None, return_img=True
    )
    assert picture.shape == (1000, 1800, 3)
    assert (np.ptp(picture.astype(float), axis=2) > 25).mean() > 0.15


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have a screen without DISPLAY")
def test_refuses_window_without_screen(bench_folder, monkeypatch):
    """Without a screen, `view` without a file is refused, and the message suggests a file."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    answer = run_cli("view", bench_folder)
    assert answer.code == 4 and "no screen" in answer.err and "-o FILE.png" in answer.err


@pytest.mark.share(0, 1)
@pytest.mark.parametrize(
    "stand_in, message", [(ABORTS, "signal 6"), (FAILS, "no device"), (HANGS, "more than 60 s")]
)
def test_refuses_window_without_opengl(bench_folder, tmp_path, monkeypatch, stand_in, message):
    """Without working OpenGL, `view` is refused with the cause: a signal, an exception or a timeout."""
    (tmp_path / "pyvista.py").write_text(stand_in)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("DISPLAY", ":99")
    answer = run_cli("view", bench_folder)
    assert answer.code == 4 and "no working OpenGL" in answer.err and message in answer.err
    assert "-o FILE.png" in answer.err


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        (["-o", "a.bmp"], 2, ".png, .svg, .pdf"),
        (["-o", "a.svg", "--frame", "999"], 2, "--frame"),
        (["-o", "a.svg", "--magnify", "-1"], 2, "--magnify"),
        (["-o", "a.svg", "--magnify", "nan"], 2, "--magnify"),
        (["-o", "nowhere/x/a.svg", "--frame", "999"], 2, "--frame"),
    ],
)
def test_refuses_figure_with_invalid_options(
    bench_folder, tmp_path, monkeypatch, arguments, code, message
):
    """Figures of an unsupported file type, an absent frame or an invalid magnification are refused."""
    monkeypatch.chdir(tmp_path)
    answer = run_cli("view", bench_folder, *arguments)
    assert answer.code == code and message in answer.err
    assert not list(tmp_path.iterdir())


def test_exact_title_of_picture_is_title_of_scene(bench_folder, tmp_path):
    """A picture has the title of the scene, or the name of the folder if there is no title."""
    other = tmp_path / "other"
    other.mkdir()
    (other / "fields.vtkhdf").write_bytes((bench_folder / "fields.vtkhdf").read_bytes())
    assert "a.svg: other, frame" in run_cli("view", other, "-o", tmp_path / "a.svg").out
    summary = json.loads((bench_folder / "summary.json").read_text("utf-8"))
    (other / "summary.json").write_text(json.dumps(summary | {"title": "Two pieces"}), "utf-8")
    assert "b.svg: Two pieces, frame" in run_cli("view", other, "-o", tmp_path / "b.svg").out
    assert "Two pieces" in (tmp_path / "b.svg").read_text("utf-8")
