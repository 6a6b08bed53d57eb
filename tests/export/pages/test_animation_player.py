"""Animation player of a page: the reduced mesh keeps integrals, the numbers agree with the fields file."""

import base64
import json

import h5netcdf
import numpy as np
import pytest
from command_line import run_cli
from exported import CROWNED
from page_data import read_page_data

from patchfem.export import report
from patchfem.export.drawing.panels import make_panels, quadrilateral_areas
from patchfem.export.fields.series import Series, last_consecutive_frames
from patchfem.export.page_data import PressedPatch, RunData, SceneText, Verdict
from patchfem.export.pages import player
from patchfem.export.pages.thinned import reduce_mesh

SIDES = ("lower", "upper")


def unpack_array(box: dict) -> np.ndarray:
    """Return the array that the page makes of a packed array."""
    number = np.frombuffer(base64.b64decode(box["data"]), "<u2").astype(float)
    return np.where(number == 65535, np.nan, box["low"] + box["step"] * number).reshape(
        box["shape"]
    )


def tensor_grid(x, depth) -> tuple:
    """Return points and cells of a tensor grid."""
    points = np.stack(np.meshgrid(x, depth, indexing="ij"), axis=-1).reshape(-1, 2)
    node = np.arange(len(points)).reshape(len(x), -1)
    return points, np.stack(
        [node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1
    ).reshape(-1, 4)


@pytest.fixture(scope="module")
def graded_mesh() -> tuple:
    """Return a grid of 90 x 24 cells, finer towards both ends and the top, with four coated rows."""
    x = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 91))
    depth = np.linspace(0, 1, 25) ** 2
    points, cells = tensor_grid(x, depth)
    return points, cells, np.tile(np.arange(24) < 4, 90)


def test_exact_reduced_mesh_keeps_integrals(graded_mesh):
    """The means over the cells of a reduced mesh keep the integral of a field.

    For a linear field they equal its values at the centres of the cells.
    """
    points, cells, coated = graded_mesh
    mesh = reduce_mesh(points, cells, coated, 300)
    centres = points[cells].mean(axis=1)
    field = np.stack([3 + 2 * centres[:, 0] - centres[:, 1], np.sin(9 * centres[:, 0])], axis=1)
    means = mesh.means(field)
    areas = quadrilateral_areas(points[mesh.nodes], mesh.cells)
    np.testing.assert_allclose(
        areas @ means, quadrilateral_areas(points, cells) @ field, rtol=1e-12, atol=1e-13
    )
    reduced_centres = points[mesh.nodes][mesh.cells].mean(axis=1)
    np.testing.assert_allclose(
        means[:, 0], 3 + 2 * reduced_centres[:, 0] - reduced_centres[:, 1], rtol=1e-12, atol=1e-12
    )


@pytest.fixture(scope="module")
def player_data(bench_folder):
    """Return the data of the player of the bench."""
    return player.player_data(bench_folder)


@pytest.fixture(scope="module")
def coarse_folder(tmp_path_factory):
    """Return the results folder of a pair with so few cells that the player shows all of them."""
    folder = tmp_path_factory.mktemp("coarse")
    (folder / "bench.toml").write_text(CROWNED, "utf-8")
    size = "contact.element_size=0.8 mm"
    answer = run_cli(
        "run", folder / "bench.toml", "--set", size, "-o", folder / "out", "-q", "--no-page"
    )
    assert answer.code == 0, answer.err
    return folder / "out"


def test_exact_player_agrees_with_fields_file(coarse_folder):
    """Positions, stresses and pressures of the player agree with the fields file and with the figures of `view`."""
    data = player.player_data(coarse_folder)
    assert data["cells"][0] == data["cells"][1]
    with Series(coarse_folder) as series:
        numbers = last_consecutive_frames(series.times)
        assert data["of"] == len(numbers)
        gap = 200.0
        slide_factor = 50.0
        for index, time in list(enumerate(data["times"]))[::5]:
            frame = series.frame(int(np.searchsorted(series.times, time)))
            panel = make_panels(frame, (gap, gap), slide_factor=slide_factor)[0]
            assert data["slide"][index] == pytest.approx(panel.slide, rel=1e-9)
            slide_offset = np.array([slide_factor * data["slide"][index], 0.0])
            expected_points = np.split(
                panel.places[: sum(len(series.points(component)) for component in SIDES)],
                [len(series.points("lower"))],
            )
            for side, piece, expected in zip((0, 1), data["pieces"], expected_points):
                positions = (
                    unpack_array(piece["points"])
                    + gap * unpack_array(piece["moves"])[index]
                    + side * slide_offset
                )
                np.testing.assert_allclose(positions, expected, atol=2e-4 * np.ptp(expected))
                stress = frame.blocks[SIDES[side]].cell_data
                for number, component in enumerate(
                    (stress["von_mises"], *stress["stress"][:, [0, 1, 3]].T)
                ):
                    box = piece["colours"][number]
                    scale = {"MPa": 1e-6, "kPa": 1e-3}[data["colours"][number]["unit"]]
                    np.testing.assert_allclose(
                        unpack_array(box)[index], component * scale, atol=box["step"]
                    )
            line = frame.blocks["interface"].point_data
            pressure = data["curves"][0]
            np.testing.assert_allclose(
                unpack_array(pressure["values"])[index] * 1e6,
                line["normal_stress"],
                atol=1e6 * pressure["values"]["step"],
            )


@pytest.fixture(scope="module")
def player_page(bench_folder, player_data, chromium):
    """Return the page of the bench in a browser, with HTML markup in its title and its scene."""
    summary = json.loads((bench_folder / "summary.json").read_text("utf-8"))
    summary["title"] = (
        '<img src=x onerror="window.hacked=1"></script><script>window.hacked=1</script>'
    )
    with h5netcdf.File(bench_folder / "result.nc", "r") as file:
        x = file["x"][...]
        fields = {
            "normal_stress": file["normal_stress"][...],
            "time": file["frame_time"][...],
            "shear_stress": file["shear_stress"][...],
        }
    text = report.page_html(
        RunData(
            SceneText("a", "</pre><b id=evil>&", ""),
            Verdict(summary, "s"),
            {},
            PressedPatch(x, fields=fields, film=player_data),
        )
    )
    assert len(text.encode()) < 3e6 and read_page_data(text)["player"]["of"] == player_data["of"]
    return chromium.open_html(text)


def frame_caption(page) -> str:
    """Return the caption of the present frame of the player."""
    return page.evaluate("document.getElementById('stage-told').textContent")


def test_exact_controls_change_player_frame(player_page, player_data):
    """Slider, keys and buttons of the player change the frame, its caption and its picture."""
    count = len(player_data["times"])
    assert player_page.faults == [] and frame_caption(player_page).startswith(
        f"Frame {player_data['first'] + 1} of {count}, "
    )
    pictures = {}
    for number in (0, count // 2, count - 1):
        player_page.evaluate(
            f"(at => {{ at.value = {number}; at.dispatchEvent(new Event('input')); }})"
            "(document.getElementById('play-frame'))"
        )
        assert frame_caption(player_page).startswith(
            f"Frame {number + 1} of {count}, {player_data['times'][number]:.7g} s"
        )
        pictures[player_page.evaluate("document.getElementById('stage-pieces').toDataURL()")] = (
            number
        )
    assert len(pictures) == 3  # the three frames have different pictures
    player_page.evaluate("document.getElementById('stage').focus()")
    for key, number in (("ArrowLeft", count - 1), ("Home", 1), ("ArrowRight", 2), ("End", count)):
        player_page.press_key(key)
        assert frame_caption(player_page).startswith(f"Frame {number} of")
    player_page.press_key(" ")
    assert player_page.evaluate("document.getElementById('play-run').textContent") == "pause"
    assert player_page.evaluate(
        "new Promise(done => setTimeout(() => done(document.getElementById('play-frame').value), 700))"
    ) != str(count - 1)
    player_page.evaluate("document.getElementById('play-run').click()")
    assert player_page.evaluate("document.getElementById('play-run').textContent") == "play"


def test_always_markup_in_title_or_scene_is_escaped(player_page):
    """HTML markup in a title or a scene is shown as text and not executed."""
    assert (
        not player_page.evaluate("window.hacked")
        and player_page.evaluate("document.getElementById('evil')") is None
    )
    assert player_page.evaluate("document.querySelector('h1').textContent").startswith(
        "<img src=x onerror="
    )


def test_exact_view_writes_page_with_player(bench_folder, player_data, tmp_path, chromium):
    """The command `view` writes a page that contains only the player."""
    answer = run_cli("view", bench_folder, "-o", tmp_path / "a.html")
    assert answer.code == 0 and answer.out.endswith(
        f"a.html: {len(player_data['times'])} frames\n"
    ), answer.err
    page = chromium.open_html((tmp_path / "a.html").read_text("utf-8"))
    assert (
        page.faults == []
        and page.evaluate("document.querySelector('h1').textContent") == bench_folder.name
    )
    assert page.evaluate("document.getElementById('play-frame').max") == str(
        len(player_data["times"]) - 1
    )
    assert frame_caption(page).startswith(f"Frame {player_data['first'] + 1} of ")
