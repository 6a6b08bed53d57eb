"""The player of a page: a thinned mesh keeps areas and means, numbers and places are those of the fields file."""

import base64
import json
from time import monotonic

import h5netcdf
import numpy as np
import pytest
from command_line import cli
from exported import CROWNED
from page_data import data_of

from patchfem.export import report
from patchfem.export.drawing.panels import make_panels, quadrilateral_areas
from patchfem.export.fields.series import Series, last_consecutive_frames
from patchfem.export.page_data import PressedPatch, RunData, SceneText, Verdict
from patchfem.export.pages import player
from patchfem.export.pages.thinned import reduce_mesh

SIDES = ("lower", "upper")


def unpacked(box: dict) -> np.ndarray:
    """What the page makes of a packed array."""
    number = np.frombuffer(base64.b64decode(box["data"]), "<u2").astype(float)
    return np.where(number == 65535, np.nan, box["low"] + box["step"] * number).reshape(
        box["shape"]
    )


def grid(x, depth) -> tuple:
    """Points and cells of a tensor grid."""
    points = np.stack(np.meshgrid(x, depth, indexing="ij"), axis=-1).reshape(-1, 2)
    node = np.arange(len(points)).reshape(len(x), -1)
    return points, np.stack(
        [node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1
    ).reshape(-1, 4)


@pytest.fixture(scope="module")
def graded() -> tuple:
    """A grid of 90 by 24 cells, finer towards both ends and the top, four rows of it coated."""
    x = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 91))
    depth = np.linspace(0, 1, 25) ** 2
    points, cells = grid(x, depth)
    return points, cells, np.tile(np.arange(24) < 4, 90)


def test_exact_means_keep_the_integral_and_a_linear_field_its_middle_value(graded):
    points, cells, coated = graded
    mesh = reduce_mesh(points, cells, coated, 300)
    middle = points[cells].mean(axis=1)
    field = np.stack([3 + 2 * middle[:, 0] - middle[:, 1], np.sin(9 * middle[:, 0])], axis=1)
    means = mesh.means(field)
    size = quadrilateral_areas(points[mesh.nodes], mesh.cells)
    np.testing.assert_allclose(
        size @ means, quadrilateral_areas(points, cells) @ field, rtol=1e-12, atol=1e-13
    )
    own = points[mesh.nodes][mesh.cells].mean(axis=1)
    np.testing.assert_allclose(means[:, 0], 3 + 2 * own[:, 0] - own[:, 1], rtol=1e-12, atol=1e-12)


def test_always_any_mesh_is_thinned_to_whole_cells_of_the_same_outline():
    rng = np.random.default_rng(4)
    points, cells = grid(np.linspace(-1, 1, 61), np.linspace(0, 1, 41))
    inner = (np.abs(points[:, 0]) < 1) & (points[:, 1] > 0) & (points[:, 1] < 1)
    points = points + inner[:, None] * rng.uniform(-0.3, 0.3, points.shape) * [1 / 30, 1 / 40]
    triangles = np.concatenate([cells[:, [0, 1, 2, 2]], cells[:, [0, 2, 3, 3]]])
    mesh = reduce_mesh(points, triangles, np.zeros(len(triangles), bool), 600)
    assert 100 < len(mesh.cells) <= 660
    size = quadrilateral_areas(points[mesh.nodes], mesh.cells)
    assert size.min() > 0 and size.sum() == pytest.approx(2.0, rel=0.05)
    kept = points[mesh.nodes]
    assert (kept.min(axis=0) == points.min(axis=0)).all() and (
        kept.max(axis=0) == points.max(axis=0)
    ).all()
    np.testing.assert_allclose(mesh.means(np.full((len(triangles), 1), 7.0)), 7.0, rtol=1e-14)


def test_exact_packed_numbers_are_within_half_a_step():
    values = np.random.default_rng(1).normal(size=(3, 50)) * 1e7
    values[1, 3] = np.nan
    found = unpacked(player.pack_array(values))
    np.testing.assert_allclose(
        found, values, atol=0.51 * np.ptp(values[np.isfinite(values)]) / 65534
    )
    assert np.array_equal(unpacked(player.pack_array(np.arange(5000))).round(), np.arange(5000))
    assert np.array_equal(unpacked(player.pack_array(np.full(3, 2.5))), np.full(3, 2.5))


@pytest.fixture(scope="module")
def film(bench):
    return player.player_data(bench)


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """The results folder of a pair with so few cells that the player shows all of them."""
    place = tmp_path_factory.mktemp("coarse")
    (place / "bench.toml").write_text(CROWNED, "utf-8")
    size = "contact.element_size=0.8 mm"
    answer = cli("run", place / "bench.toml", "--set", size, "-o", place / "out", "-q", "--no-page")
    assert answer.code == 0, answer.err
    return place / "out"


def test_exact_numbers_and_places_are_those_of_the_fields(coarse):
    """What the player draws at some factors is what the pictures of `view` draw at the same ones."""
    film = player.player_data(coarse)
    assert film["cells"][0] == film["cells"][1]
    with Series(coarse) as series:
        numbers = last_consecutive_frames(series.times)
        assert film["of"] == len(numbers)
        gap = 200.0
        aside = 50.0
        for at, time in list(enumerate(film["times"]))[::5]:
            frame = series.frame(int(np.searchsorted(series.times, time)))
            drawn = make_panels(frame, (gap, gap), slide_factor=aside)[0]
            assert film["slide"][at] == pytest.approx(drawn.slide, rel=1e-9)
            shift = np.array([aside * film["slide"][at], 0.0])
            parts = np.split(
                drawn.places[: sum(len(series.points(one)) for one in SIDES)],
                [len(series.points("lower"))],
            )
            for side, piece, places in zip((0, 1), film["pieces"], parts):
                found = (
                    unpacked(piece["points"]) + gap * unpacked(piece["moves"])[at] + side * shift
                )
                np.testing.assert_allclose(found, places, atol=2e-4 * np.ptp(places))
                stress = frame.blocks[SIDES[side]].cell_data
                for number, one in enumerate(
                    (stress["von_mises"], *stress["stress"][:, [0, 1, 3]].T)
                ):
                    box = piece["colours"][number]
                    scale = {"MPa": 1e-6, "kPa": 1e-3}[film["colours"][number]["unit"]]
                    np.testing.assert_allclose(unpacked(box)[at], one * scale, atol=box["step"])
            line = frame.blocks["interface"].point_data
            pressure = film["curves"][0]
            np.testing.assert_allclose(
                unpacked(pressure["values"])[at] * 1e6,
                line["normal_stress"],
                atol=1e6 * pressure["values"]["step"],
            )


def test_always_a_page_holds_what_it_can(film):
    assert len(film["times"]) <= player.MAX_FRAMES and film["cells"][0] <= film["cells"][1]
    told = player.player_section(film).html
    assert "frames from" in told and "Motion and gap are magnified by one factor" in told


def test_exact_results_without_fields_have_no_player(tmp_path):
    assert player.player_data(tmp_path) is None


@pytest.fixture(scope="module")
def opened(bench, film, chromium):
    """The page of the bench in a browser, its title and the scene with markup in them."""
    summary = json.loads((bench / "summary.json").read_text("utf-8"))
    summary["title"] = (
        '<img src=x onerror="window.hacked=1"></script><script>window.hacked=1</script>'
    )
    with h5netcdf.File(bench / "result.nc", "r") as file:
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
            PressedPatch(x, fields=fields, film=film),
        )
    )
    assert len(text.encode()) < 3e6 and data_of(text)["player"]["of"] == film["of"]
    return chromium.opened(text)


def told(page) -> str:
    return page.js("document.getElementById('stage-told').textContent")


def test_exact_in_a_browser_slider_keys_and_buttons_move_the_frame(opened, film):
    count = len(film["times"])
    assert opened.faults == [] and told(opened).startswith(
        f"Frame {film['first'] + 1} of {count}, "
    )
    seen = {}
    for number in (0, count // 2, count - 1):
        opened.js(
            f"(at => {{ at.value = {number}; at.dispatchEvent(new Event('input')); }})"
            "(document.getElementById('play-frame'))"
        )
        assert told(opened).startswith(
            f"Frame {number + 1} of {count}, {film['times'][number]:.7g} s"
        )
        seen[opened.js("document.getElementById('stage-pieces').toDataURL()")] = number
    assert len(seen) == 3  # three frames, three pictures
    opened.js("document.getElementById('stage').focus()")
    for key, number in (("ArrowLeft", count - 1), ("Home", 1), ("ArrowRight", 2), ("End", count)):
        opened.pressed(key)
        assert told(opened).startswith(f"Frame {number} of")
    opened.pressed(" ")
    assert opened.js("document.getElementById('play-run').textContent") == "pause"
    assert opened.js(
        "new Promise(done => setTimeout(() => done(document.getElementById('play-frame').value), 700))"
    ) != str(count - 1)
    opened.js("document.getElementById('play-run').click()")
    assert opened.js("document.getElementById('play-run').textContent") == "play"


def test_exact_in_a_browser_the_pointer_reads_values(opened, film):
    opened.js(
        "document.getElementById('play-frame').value = 0;"
        "document.getElementById('play-frame').dispatchEvent(new Event('input'));"
        "document.getElementById('stage').scrollIntoView()"
    )
    left, top, wide, high = opened.js(
        "(({x, y, width, height}) => [x, y, width, height])"
        "(document.getElementById('stage-curve').getBoundingClientRect())"
    )
    opened.pointed(left + wide / 2, top + high / 2)
    tip = opened.js("document.getElementById('stage-tip').textContent")
    place, value = (
        float(part.split()[1 if at == 0 else 0])
        for at, part in enumerate((tip.split(":")[0], tip.split(": pressure ")[1]))
    )
    x = unpacked(film["x"])
    sigma = unpacked(film["curves"][0]["values"])[0]
    assert value == pytest.approx(sigma[np.argmin(np.abs(x - place))], rel=1e-3)
    left, top, wide, high = opened.js(
        "(({x, y, width, height}) => [x, y, width, height])"
        "(document.getElementById('stage-pieces').getBoundingClientRect())"
    )
    for share, side in ((0.25, "upper"), (0.75, "lower")):
        opened.pointed(left + 0.45 * wide, top + share * high)
        assert f"{side} piece" in opened.js("document.getElementById('stage-tip').textContent")
        assert "von Mises stress" in opened.js("document.getElementById('stage-tip').textContent")


def test_exact_in_a_browser_both_themes_a_narrow_window_and_paper(opened):
    def until(read, right):
        """What is read once it is right, 5 s later at most: a busy browser draws later."""
        end = monotonic() + 5
        while not right(found := read()) and monotonic() < end:
            pass
        return found

    def shown() -> tuple:
        """The colour of the words, and the mean grey of what is drawn on the canvas of the curve."""
        return tuple(
            opened.js("""new Promise(done => setTimeout(() => {
            const at = document.getElementById('stage-curve'), all = at.getContext('2d').getImageData(0, 0, at.width,
                at.height).data;
            let sum = 0, weight = 0;
            for (let k = 0; k < all.length; k += 4) {
                sum += all[k + 3] * (all[k] + all[k + 1] + all[k + 2]) / 3; weight += all[k + 3]; }
            done([getComputedStyle(document.getElementById('stage-told')).color, sum / weight]); }, 100))""")
        )

    opened.themed(False, "")
    light = until(shown, lambda found: found[0] == "rgb(28, 36, 48)" and found == shown())
    opened.themed(True, "")
    dark = until(shown, lambda found: found[0] == "rgb(228, 233, 239)" and found[1] > light[1] + 20)
    assert light[0] == "rgb(28, 36, 48)"
    assert dark[0] == "rgb(228, 233, 239)"
    assert dark[1] > light[1] + 20
    themed = "document.documentElement.dataset.drawn"
    assert until(lambda: opened.js(themed), "dark".__eq__) == "dark"
    opened.themed(True, "print")  # dark inks on white paper, whatever the reader's theme is
    paper = until(shown, lambda found: found[0] == light[0] and abs(found[1] - light[1]) < 10)
    assert opened.js(themed) == "dark"
    assert "invert" in opened.js("getComputedStyle(document.querySelector('.chart')).filter")
    assert paper[0] == light[0] and abs(paper[1] - light[1]) < 10, (light, dark, paper)
    assert opened.printed().startswith(b"%PDF")
    opened.themed(False, "")
    assert until(shown, lambda found: found == light) == light
    assert opened.js("getComputedStyle(document.querySelector('.chart')).filter") == "none"
    opened.sized(420, 900)
    try:
        wide = (
            "new Promise(done => setTimeout(() => done(document.documentElement.scrollWidth), 100))"
        )
        assert until(lambda: opened.js(wide), lambda found: found <= 420) <= 420
    finally:
        opened.sized(1200, 900)


def test_always_markup_in_a_title_or_a_scene_is_text(opened):
    assert not opened.js("window.hacked") and opened.js("document.getElementById('evil')") is None
    assert opened.js("document.querySelector('h1').textContent").startswith("<img src=x onerror=")


def test_exact_view_writes_the_player_on_a_page_of_its_own(bench, film, tmp_path, chromium):
    answer = cli("view", bench, "-o", tmp_path / "a.html")
    assert answer.code == 0 and answer.out.endswith(f"a.html: {len(film['times'])} frames\n"), (
        answer.err
    )
    page = chromium.opened((tmp_path / "a.html").read_text("utf-8"))
    assert page.faults == [] and page.js("document.querySelector('h1').textContent") == bench.name
    assert page.js("document.getElementById('play-frame').max") == str(len(film["times"]) - 1)
    assert told(page).startswith(f"Frame {film['first'] + 1} of ")
