"""`patchfem compare`: verdict, table, JSON, report, a scene solved with both surfaces, and error messages."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import run_cli
from pairs import UM, make_worn_pair

from patchfem.surface import Profile

NAMES = (
    "shift",
    "worn_depth_max",
    "worn_depth_mean",
    "worn_area",
    "amplitude_ratio",
    "slope_ratio",
)
SCENE = """
[contact]
length = "0.9 mm"
width = "0.9 mm"
height = "0.5 mm"
load = "20 N"
element_size = "2 um"
substrate = "Ti-8Al-1Mo-1V"
[contact.profile]
file = "before.csv"
heights = "surface"
[contact.asperities]
law = "linear"
normal_stiffness = "1e13 Pa/m"
"""


def write_trace(path: Path, trace: Profile) -> Path:
    """Write a trace with the digits of an instrument and return its path."""
    path.write_text(
        "x [um],z [um]\n"
        + "".join(f"{x / UM:.3f},{z / UM:.4f}\n" for x, z in zip(trace.x, trace.z))
    )
    return path


@pytest.fixture(scope="module")
def trace_pair(tmp_path_factory) -> tuple:
    """Return the paths of a trace before and after wear of half the depth, and the pair."""
    p = make_worn_pair(30077, worn_fraction=0.5)
    place = tmp_path_factory.mktemp("traces")
    return write_trace(place / "before.csv", p.before), write_trace(place / "after.csv", p.after), p


@pytest.fixture(scope="module")
def comparison(trace_pair, tmp_path_factory) -> tuple:
    """Return the answer and the folder of a comparison of both traces along y."""
    out = tmp_path_factory.mktemp("compared") / "out"
    return run_cli("compare", *trace_pair[:2], "--direction", "y", "-o", out), out


def test_exact_compare_reports_shift_and_worn_depth(trace_pair, comparison):
    """The command finds the shift within 0.02 um and the worn depth within 0.1 um, with intervals, units and a report."""
    p, (answer, out) = trace_pair[2], comparison
    assert answer.code == 0
    assert re.match(
        r"Worn depth \S+ um \(\S+ to \S+\), the mean over the common length.",
        answer.out.splitlines()[1],
    )
    assert f"results: {out}" in answer.out
    found = json.loads((out / "compare.json").read_text())
    assert found["reference"] == "place" and found["direction"] == "y"
    for name in NAMES:
        assert {"value", "low", "high", "unit"} <= set(found[name])
        if found[name]["low"] is not None:
            assert found[name]["low"] <= found[name]["value"] <= found[name]["high"]
    assert found["worn_depth_mean"]["over"] == "common length"
    assert [found[name]["unit"] for name in NAMES] == ["m", "m", "m", "m2", "1", "1"]
    assert found["shift"]["value"] == pytest.approx(p.shift, abs=0.02 * UM)
    assert found["worn_depth_max"]["value"] == pytest.approx(p.worn.max(), abs=0.1 * UM)
    page = (out / "report.html").read_text()
    assert page.index("the mean over the common length.") < page.index("<figure")
    assert page.count("<figure ") == 3 == page.count('role="img" aria-label="')


def test_exact_traces_without_overlap_give_reason(trace_pair, tmp_path):
    """Traces without a common part give no worn depth but a reason, and both are drawn alone."""
    other = write_trace(tmp_path / "elsewhere.csv", make_worn_pair(50001, worn_fraction=0.3).after)
    found = json.loads(run_cli("compare", trace_pair[0], other, "--json").out)
    for name in NAMES[:4]:
        assert found[name]["value"] is None and "no part in common" in found[name]["reason"]
    assert found["amplitude_ratio"]["value"] > 0


def test_exact_identical_traces_show_no_change(trace_pair):
    """Two identical traces are said to be the same file."""
    found = json.loads(run_cli("compare", trace_pair[0], trace_pair[0], "--json").out)
    assert found["code"] == "identical" and found["verdict"].startswith("No wear: both files hold")


@pytest.mark.slow
def test_always_scene_is_solved_with_both_surfaces(trace_pair, tmp_path):
    """A scene solved with both surfaces has a lower peak pressure and a larger contact fraction after wear.

    A run with the stored surface gives the same peak within 1e-12.
    """
    (tmp_path / "patch.toml").write_text(SCENE.replace("before.csv", str(trace_pair[0])))
    out = tmp_path / "out"
    answer = run_cli(
        "compare", trace_pair[0], trace_pair[1], "--scene", tmp_path / "patch.toml", "-o", out
    )
    assert answer.code == 0, answer.err
    found = json.loads((out / "compare.json").read_text())["pressed"]
    for name in ("pressure_peak", "contact_fraction", "normal_stiffness"):
        assert {"value", "error", "unit"} == set(found["measures"][name]["before"])
    peak, fraction = (found["measures"][name] for name in ("pressure_peak", "contact_fraction"))
    # worn plateaus carry a larger part of the load
    assert peak["after"]["value"] < 0.6 * peak["before"]["value"]
    assert fraction["after"]["value"] > fraction["before"]["value"]
    assert any(
        text.startswith("energy dissipated by friction per cycle: not computed")
        for text in found["lacking"]
    )
    page = (out / "report.html").read_text()
    assert page.count("<figure ") == 4 and "Scene pressed with each of the two surfaces" in page
    profile = f"contact.profile.file={out / 'surface_after.csv'}"
    single_run = run_cli(
        "run", tmp_path / "patch.toml", "--set", profile, "--json", "-o", tmp_path / "alone"
    )
    assert json.loads(single_run.out)["measures"]["pressure_peak"]["value"] == pytest.approx(
        peak["after"]["value"], rel=1e-12
    )


@pytest.mark.parametrize("verb", ["compare", "profile"])
def test_refuses_output_folder_with_foreign_files(tmp_path, verb):
    """An output folder with the measured files is refused, and the files stay unchanged."""
    rows = "x [um],z [um]\n" + "".join(f"{k},{np.sin(k / 9):.4f}\n" for k in range(2000))
    for name in ("before.csv", "after.csv"):
        (tmp_path / "data" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "data" / name).write_text(rows)
    files = [tmp_path / "data" / name for name in ("before.csv", "after.csv")]
    answer = run_cli(verb, *files, "-o", tmp_path / "data")
    assert answer.code == 2 and "not patchfem results" in answer.err
    assert all(path.read_text() == rows for path in files)
    assert len(list((tmp_path / "data").iterdir())) == 2


def test_exact_given_shift_is_used(trace_pair):
    """A given shift in um is used, and a shift that does not fit is reported as not available."""
    shift = trace_pair[2].shift
    answer = run_cli("compare", *trace_pair[:2], "--shift", f"{shift / UM:.1f} um", "--json")
    found = json.loads(answer.out)
    assert found["reference"] == "place"
    assert found["shift"]["value"] == pytest.approx(shift, abs=0.02 * UM)
    answer = run_cli("compare", *trace_pair[:2], "--shift", f"{shift / UM + 300:.1f} um")
    assert "Not comparable: the two surfaces have no part in common" in answer.out
