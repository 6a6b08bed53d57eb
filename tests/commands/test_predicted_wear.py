"""`patchfem compare --predicted`: wear coefficient from traces and a run with wear, and roughness by region."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray
from command_line import read_json, read_page, run_successfully
from scipy.ndimage import gaussian_filter1d

import patchfem as pf

PIECE_SHARE = 0.5
COARSE = {"contact.element_size": "0.1 mm"}
RUN = """
[contact]
length = "3 mm"
width = "3 mm"
height = "2 mm"
load = "60 N"
substrate = "steel"
[contact.crown]
radius = "2 m"
[friction]
law = "coulomb"
static = 0.3
[slide]
kind = "sine"
amplitude = "10 um"
frequency = "10 Hz"
cycles = 2
[wear]
coefficient = "1e-14 m^2/N"
cycles = 300000
"""


def write_trace(path: Path, x, z) -> Path:
    """Write a trace (x, z [m]) as a table in um and return its path."""
    rows = [f"{a * 1e6!r},{b * 1e6!r}" for a, b in zip(x.tolist(), z.tolist())]
    path.write_text("\n".join(["x [um],z [um]", *rows, ""]), "utf-8")
    return path


def write_traces(folder: Path, x, *heights) -> list[Path]:
    """Write the traces before and after wear, and return their paths."""
    names = ("before.csv", "after.csv")
    return [write_trace(folder / name, x, z) for name, z in zip(names, heights, strict=True)]


def draw_surface(x) -> np.ndarray:
    """Draw a Gaussian surface (n,) [m] of 0.5 um rms and waves above 10 um."""
    random = np.random.default_rng(58)
    kernel = np.exp(-0.5 * (np.arange(-40, 41) / 8) ** 2)
    z = np.convolve(random.normal(size=x.size + 80), kernel, "valid")
    return 0.5e-6 * z / z.std()


@pytest.fixture(scope="module")
def artificial_pair(tmp_path_factory) -> tuple:
    """Return the folder of a run, traces with its wear by another coefficient, the true values of this wear.

    The depth along a crowned, tilted patch is that of an independent program (`tests/support/wear_scenes.py` of version
    1.10). It varies by 6 % about Archard's law, and each trace has its own start, tilt and noise.
    """
    truth = read_json(Path(__file__).with_name("worn_patch.json"))
    folder = tmp_path_factory.mktemp("made") / "wear"
    pf.run(truth["scene"], **COARSE).save(folder)
    x = np.arange(0.0, 8e-3, 1e-6)
    random = np.random.default_rng(7)
    new = draw_surface(x)
    middle = 3.7e-3
    depth = np.interp(x - middle, truth["x"], truth["depth"], left=0.0, right=0.0)
    process = gaussian_filter1d(random.normal(size=x.size), 100)
    # The share of the lower piece is 1 - wear.upper_share.
    worn = (1 - 0.426) * depth * (1 + 0.06 * process / process.std())
    starts = (100e-6, 240e-6)
    traces = []
    for heights, start in zip((new, new - worn), starts):
        points = x[:7500]
        z = np.interp(points + start, x, heights) + 5e-9 * random.normal(size=points.size)
        traces.append((points, z + random.uniform(-0.8e-3, 0.8e-3) * points))
    return folder, traces, truth, middle - starts[1]


@pytest.fixture(scope="module")
def crowned_run(tmp_path_factory) -> Path:
    """Return the folder of a run in which the contact of a crown grows by wear."""
    return pf.run(RUN, **COARSE).save(tmp_path_factory.mktemp("crowned") / "wear")


def test_always_wear_coefficient_interval_covers_true_value(artificial_pair, tmp_path):
    """The intervals of the wear coefficient and of the patch centre cover the true values."""
    folder, traces, truth, centre = artificial_pair
    out = tmp_path / "out"
    x = traces[0][0]
    files = write_traces(tmp_path, x, *(z[::-1] for _, z in traces))
    centre = x[0] + x[-1] - centre
    answer = run_successfully(
        "compare", *files, "--predicted", folder, "--piece", "lower", "-o", out
    )
    data = read_json(out / "compare.json")
    predicted = data["predicted"]
    for name, true in (("coefficient", truth["coefficient"]), ("patch_centre", centre)):
        assert predicted[name]["low"] <= true <= predicted[name]["high"]
    assert predicted["coefficient"]["high"] < 1.1 * predicted["coefficient"]["low"]
    assert predicted["coefficient"]["unit"] == "m2 N-1"
    assert data["sentences"][-1] == predicted["sentence"] and predicted["warnings"] == []
    assert predicted["sentence"] in answer.out and "wear_coefficient" in answer.out
    table = np.loadtxt(out / "predicted.csv", delimiter=",", skiprows=1)
    rms = np.sqrt(np.mean(table[np.abs(table[:, 0]) <= truth["length"] / 2, 5] ** 2))
    assert rms == pytest.approx(predicted["difference_rms"], rel=1e-4)
    with xarray.open_dataset(folder / "result.nc") as result:
        depth = np.interp(table[:, 0], result.x.values, result.wear_worn_depth.values[-1])
    inside = np.abs(table[:, 0]) < 0.45 * truth["length"]
    assert np.corrcoef(depth[inside], table[inside, 4])[0, 1] > 0.99
    page = read_page(out)
    assert "Computed and measured wear" in page


@pytest.mark.long
def test_wear_coefficient_follows_run_history(crowned_run, tmp_path):
    """The coefficient for a wear state inside the history of the run agrees within 2e-3.

    The depth is not proportional to the coefficient there.
    """
    with xarray.open_dataset(crowned_run / "result.nc") as result:
        frame = 8
        place = result.x.values
        depth = result.wear_worn_depth.values[frame]
        volume = result.wear_worn_depth.values @ result.weight.values
    ratio = volume[frame] / volume[-1]
    x = np.arange(0.0, 5e-3, 1e-6)
    before = draw_surface(x)
    worn = PIECE_SHARE * np.interp(x - 2.2e-3, place, depth, left=0.0, right=0.0)
    noise = 1e-9 * np.random.default_rng(1).normal(size=x.size)
    files = write_traces(tmp_path, x, before, before - worn + noise)
    predicted = pf.compare(*files, predicted=crowned_run)["predicted"]
    assert predicted["coefficient"]["value"] / 1e-14 == pytest.approx(ratio, rel=2e-3)
    assert predicted["proportional_coefficient"] / 1e-14 > 1.05 * ratio
    assert predicted["difference_rms"] < 5e-9 and predicted["warnings"] == []
    assert any("not proportional" in note for note in predicted["notes"])
    deep_trace = write_trace(tmp_path / "deep.csv", x, before - 1e3 * worn)
    with pytest.raises(pf.PatchfemError, match="check the units of z"):
        pf.compare(files[0], deep_trace, shift=0.0, predicted=crowned_run)


@pytest.mark.long
@pytest.mark.parametrize("share, scatter", [(0.5, 0.0), (0.5, 0.3), (1.0, 0.3)])
def test_tells_a_wrong_share_from_scatter(crowned_run, tmp_path, share, scatter):
    """A depth of half the share has another shape, and scatter by 30 % over short waves has not.

    The interval does not contain the coefficient of the wrong share.
    """
    with xarray.open_dataset(crowned_run / "result.nc") as result:
        place = result.x.values
        depth = result.wear_worn_depth.values[-1]
    x = np.arange(0.0, 5e-3, 1e-6)
    random = np.random.default_rng(2)
    waves = np.interp(x, x[::20], random.normal(size=x[::20].size))
    before = draw_surface(x)
    worn = share * PIECE_SHARE * np.interp(x - 2.2e-3, place, depth, left=0.0, right=0.0)
    worn = worn * (1 + scatter * waves) + 1e-9 * random.normal(size=x.size)
    files = write_traces(tmp_path, x, before, before - worn)
    content = pf.compare(*files, predicted=crowned_run)
    predicted = content["predicted"]
    mean = re.search(r"mean computed depth over the patch, ([\d.]+) nm", predicted["sentence"])
    percent = 100e9 * predicted["difference_rms"] / float(mean[1])
    assert percent > 10
    is_covered = predicted["coefficient"]["low"] <= 1e-14 <= predicted["coefficient"]["high"]
    if share == 1:
        assert is_covered and predicted["warnings"] == []
        return
    (warning,) = predicted["warnings"]
    assert not is_covered and content["sentences"][-1] == warning
    assert f"by {percent:.2g} % of the mean computed depth (rms)" in warning
    assert "wear.upper_share" in warning
