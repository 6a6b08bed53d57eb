"""`patchfem compare --predicted`: wear coefficient from traces and a run with wear, and roughness by region."""

import json
from pathlib import Path

import numpy as np
import predicted_pairs
import pytest
import xarray
from command_line import run_cli

import patchfem as pf

SEED = 5  # seed of a tilted patch whose traces contain the whole wear track
PIECE_SHARE = 0.5
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


def draw_surface(x) -> np.ndarray:
    """Draw a Gaussian surface (n,) [m] of 0.5 um rms and waves above 10 um."""
    random = np.random.default_rng(58)
    kernel = np.exp(-0.5 * (np.arange(-40, 41) / 8) ** 2)
    z = np.convolve(random.normal(size=x.size + 80), kernel, "valid")
    return 0.5e-6 * z / z.std()


@pytest.fixture(scope="module")
def artificial_pair(tmp_path_factory) -> tuple:
    """Return the folder with traces and run of an artificial pair, and the pair."""
    folder = tmp_path_factory.mktemp("made")
    pair = predicted_pairs.draw_pair(SEED)
    predicted_pairs.write_pair(pair, folder)
    pf.run(folder / "scene.toml").save(folder / "wear")
    return folder, pair


@pytest.fixture(scope="module")
def crowned_run(tmp_path_factory) -> Path:
    """Return the folder of a run in which the contact of a crown grows by wear."""
    folder = tmp_path_factory.mktemp("crowned") / "wear"
    pf.run(RUN).save(folder)
    return folder


def test_always_wear_coefficient_interval_covers_true_value(artificial_pair, tmp_path):
    """The intervals of the wear coefficient and of the patch centre cover the true values."""
    folder, pair = artificial_pair
    out = folder / "out"
    files = []
    for name in ("before.csv", "after.csv"):
        x, z = np.loadtxt(folder / name, delimiter=",", skiprows=1, unpack=True) * 1e-6
        files.append(write_trace(tmp_path / name, x, z[::-1]))
    centre = x[0] + x[-1] - pair.centre
    answer = run_cli(
        "compare", *files, "--predicted", folder / "wear", "--piece", pair.piece, "-o", out
    )
    assert answer.code == 0, answer.err
    data = json.loads((out / "compare.json").read_text("utf-8"))
    predicted = data["predicted"]
    for name, truth in (("coefficient", pair.scene.coefficient), ("patch_centre", centre)):
        assert predicted[name]["low"] <= truth <= predicted[name]["high"]
    assert predicted["coefficient"]["high"] < 1.1 * predicted["coefficient"]["low"]
    assert predicted["coefficient"]["unit"] == "m2 N-1"
    assert data["sentences"][-1] == predicted["sentence"]
    assert predicted["sentence"] in answer.out and "wear_coefficient" in answer.out
    table = np.loadtxt(out / "predicted.csv", delimiter=",", skiprows=1)
    rms = np.sqrt(np.mean(table[np.abs(table[:, 0]) <= pair.scene.patch.length / 2, 5] ** 2))
    assert rms == pytest.approx(predicted["difference_rms"], rel=1e-4)
    with xarray.open_dataset(folder / "wear" / "result.nc") as result:
        depth = np.interp(table[:, 0], result.x.values, result.wear_worn_depth.values[-1])
    inside = np.abs(table[:, 0]) < 0.45 * pair.scene.patch.length
    assert np.corrcoef(depth[inside], table[inside, 4])[0, 1] > 0.99
    page = (out / "report.html").read_text("utf-8")
    assert "Computed and measured wear" in page


def test_exact_wear_coefficient_follows_run_history(crowned_run, tmp_path):
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
    files = (
        write_trace(tmp_path / "before.csv", x, before),
        write_trace(tmp_path / "after.csv", x, before - worn + noise),
    )
    predicted = pf.compare(*files, predicted=crowned_run)["predicted"]
    assert predicted["coefficient"]["value"] / 1e-14 == pytest.approx(ratio, rel=2e-3)
    assert predicted["proportional_coefficient"] / 1e-14 > 1.05 * ratio
    assert predicted["difference_rms"] < 5e-9
    assert any("not proportional" in note for note in predicted["notes"])
    deep_trace = write_trace(tmp_path / "deep.csv", x, before - 1e3 * worn)
    with pytest.raises(pf.PatchfemError, match="check the units of z"):
        pf.compare(files[0], deep_trace, shift=0.0, predicted=crowned_run)
