"""Pictures and films of the pieces agree with the fields of the file, or are refused with a sentence."""

import re

import numpy as np
import pytest
from command_line import run_cli, run_successfully
from exported import write_small_series
from PIL import Image

from patchfem.export.fields.film import find_contact_window, make_stress_panels
from patchfem.export.fields.vtkhdf import Block, Frames, read_frames
from patchfem.export.pieces import draw_pieces, magnify_pieces

WHOLE = (-1.0, 1.0, -1.0, 1.0)  # [m], a window that contains all pieces


@pytest.fixture(scope="module")
def small_folder(tmp_path_factory):
    """Return the folder of a pressed state and, long after it, three frames of random fields."""
    folder = tmp_path_factory.mktemp("small") / "out"
    write_small_series(folder, times=[0.0, 1.0, 1.001, 1.002], frames=4)
    return folder


@pytest.mark.parametrize("magnify", [None, 0.0, 2500.0])
def test_exact_drawn_gap_is_magnified_gap(bench_folder, magnify):
    """The pieces move by displacement times factor, the slide has its own factor, and the gap is the computed one."""
    frames = read_frames(bench_folder / "fields.vtkhdf")
    numbers = np.arange(len(frames.times))
    lower, upper, line = (frames.blocks[name] for name in ("lower", "upper", "interface"))
    slide = line.point_data["holder_slide"][:, 0].astype(float)
    assert np.abs(slide).max() > 1e-7
    for window in (WHOLE, find_contact_window(frames)):
        drawn = magnify_pieces(frames, numbers, window, magnify)
        factor = float(re.match(r"motion × ([\d.e+]+)", drawn.captions[-1])[1])
        slide_factor = float(re.search(r"um × ([\d.e+-]+)$", drawn.captions[-1])[1])
        assert magnify in (None, factor)
        low, high = np.split(1e-3 * drawn.places, [len(lower.points)], axis=1)
        moved = lower.point_data["displacement"][..., :2].astype(float)
        expected = lower.points[:, :2] + factor * moved
        np.testing.assert_allclose(low, expected, 0, 1e-12)

        # the rigid far face
        is_far = upper.points[:, 1] == upper.points[:, 1].max()
        moved = upper.point_data["displacement"][:, is_far, :2].astype(float)
        moved[..., 0] -= slide[:, None]
        expected = upper.points[is_far, :2] + factor * moved
        expected[..., 0] += slide_factor * slide[:, None]
        np.testing.assert_allclose(high[:, is_far], expected, 0, 1e-12)

        # the upper surface above the same points of the lower one
        face = upper.points[:, 1] == 0
        surface = 1e-3 * drawn.places[:, : len(lower.points)][:, lower.points[:, 1] == 0, 1]
        gap = high[:, face, 1] - surface
        tolerance = 1e-6 * factor * np.abs(moved).max() + 1e-12
        np.testing.assert_allclose(gap, factor * line.point_data["gap"], 0, tolerance)


def test_exact_colours_are_stress_of_frame(bench_folder):
    """Cells of both panels have the stress of the frame that is shown, on one scale of all frames."""
    frames = read_frames(bench_folder / "fields.vtkhdf")
    numbers = np.arange(len(frames.times))
    figure, show = draw_pieces(frames, numbers, "a title")
    pieces, contact = (axes.collections[0] for axes in figure.axes[:2])
    parts = [frames.blocks[side].cell_data["von_mises"] for side in ("lower", "upper")]
    stress = np.concatenate(parts, axis=1)
    for number in (3, len(numbers) - 1):
        show(number)
        np.testing.assert_allclose(1e6 * pieces.get_array(), stress[number], 1e-6)
        assert set(contact.get_array()) < set(pieces.get_array())
        assert f"a title, {frames.times[number]:.6g} s" in figure.get_suptitle()
    assert pieces.get_clim() == contact.get_clim()
    assert (1e6 * pieces.get_clim()[1] >= stress).mean() == pytest.approx(0.998, abs=1e-3)


def test_vector_picture_does_not_grow_with_the_cells(bench_folder, tmp_path):
    """An SVG file contains the cells as one picture of points, so that it has fewer paths than the mesh has cells."""
    frames = read_frames(bench_folder / "fields.vtkhdf")
    figure, _ = draw_pieces(frames, np.arange(2))
    figure.savefig(tmp_path / "pieces.svg")
    text = (tmp_path / "pieces.svg").read_text()
    n_cells = sum(len(frames.blocks[side].cell_data["von_mises"][0]) for side in ("lower", "upper"))
    assert text.count("<image") >= 2
    assert text.count("<path") < n_cells / 2


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_exact_pictures_of_a_frame_are_equal_files(small_folder, tmp_path, ending):
    """Two pictures of the same frame are equal byte for byte; an SVG file once had random names of its parts."""
    paths = [tmp_path / f"{name}.{ending}" for name in "ab"]
    for path in paths:
        run_successfully("view", small_folder, "-o", path)
    first, second = (path.read_bytes() for path in paths)
    assert first == second and len(first) > 1000


def test_exact_gif_has_frames_of_last_cycle(small_folder, tmp_path):
    """A .gif has the frames of the last cycle, each with other pixels."""
    answer = run_successfully("view", small_folder, "-o", tmp_path / "a.gif")
    assert "3 frames, 1 s to 1.002 s" in answer.out
    film = Image.open(tmp_path / "a.gif")
    frames = []
    for number in range(film.n_frames):
        film.seek(number)
        frames.append(np.asarray(film.convert("RGB"), int)[60:])  # without the title
    assert len(frames) == 3
    assert all(np.abs(frames[k] - frames[k - 1]).mean() > 1 for k in range(3))


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        ([], 4, "DISPLAY is not set"),
        (["-o", "a.jpeg"], 2, ".png, .svg, .pdf, films as .gif, .mp4, .html"),
        (["-o", "a.svg", "--frame", "4"], 2, "frames 0 to 3"),
        (["-o", "a.svg", "--magnify", "-1"], 2, "--magnify"),
        (["-o", "a.svg", "--magnify", "nan"], 2, "--magnify"),
        (["-o", "a.gif", "--frame", "1"], 2, "shows all frames"),
        (["-o", "nowhere/x/a.svg", "--frame", "999"], 2, "--frame"),
    ],
)
def test_refuses_invalid_options(small_folder, tmp_path, monkeypatch, arguments, code, message):
    """No screen, an unsupported file, an absent frame or an invalid magnification is refused, and no file is written."""
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    answer = run_cli("view", small_folder, *arguments)
    assert answer.code == code and message in answer.err and not list(tmp_path.iterdir())


def test_labels_of_stress_film_differ_after_long_wear(tmp_path):
    """The labels of the frames of the last cycle begin at 0, also after 1e6 s of wear."""
    write_small_series(tmp_path / "out", times=1e6 + 1e-3 * np.arange(3))
    (panel,) = make_stress_panels(tmp_path / "out" / "fields.vtkhdf")
    assert [curve.name for curve in panel.curves] == ["0 ms", "1 ms", "2 ms"]


def test_exact_window_follows_the_contact_of_a_graded_mesh():
    """The window has eight elements at a small contact, although elements far from it are long."""
    x = np.array([-10, -1, -0.1, 0, 0.1, 1, 10]) * 1e-3
    pressure = np.eye(7)[3:4]
    line = Block(x[:, None], np.zeros((0, 2)), {"normal_stress": pressure}, {})
    window = find_contact_window(Frames("", np.zeros(1), {"interface": line}))
    assert window == pytest.approx((-0.4e-3, 0.4e-3, -0.24e-3, 0.24e-3))
