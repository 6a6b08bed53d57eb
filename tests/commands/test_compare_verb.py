"""`patchfem compare`: verdict, table, JSON, report, a scene solved with both surfaces, and error messages."""

import re

import pytest
from command_line import read_json, read_page, run_cli
from traces import write_traces

UM = 1e-6
SHIFT, DEPTH = -18.0326681977835 * UM, 4.10145533624890 * UM  # shift and largest depth of the pair
NAMES = (
    "shift",
    "worn_depth_max",
    "worn_depth_mean",
    "worn_area",
    "amplitude_ratio",
    "slope_ratio",
)


@pytest.fixture(scope="module")
def trace_pair(tmp_path_factory) -> list:
    """Return the paths of a trace before and after wear."""
    return write_traces("groove", 30077, tmp_path_factory.mktemp("traces"), ("before", "after"))


@pytest.fixture(scope="module")
def comparison(trace_pair, tmp_path_factory) -> tuple:
    """Return the answer and the folder of a comparison of both traces along y."""
    out = tmp_path_factory.mktemp("compared") / "out"
    return run_cli("compare", *trace_pair, "--direction", "y", "-o", out), out


def test_exact_compare_reports_shift_and_worn_depth(comparison):
    """The command finds the shift within 0.1 um and the worn depth within 0.1 um, with intervals, units and a report."""
    answer, out = comparison
    assert answer.code == 0
    assert re.match(
        r"Worn depth \S+ um \(\S+ to \S+\), the mean of the lost material over the common length.",
        answer.out.splitlines()[1],
    )
    assert f"results: {out}" in answer.out
    found = read_json(out / "compare.json")
    assert found["reference"] == "place" and found["direction"] == "y"
    for name in NAMES:
        assert {"value", "low", "high", "unit"} <= set(found[name])
        if found[name]["low"] is not None:
            assert found[name]["low"] <= found[name]["value"] <= found[name]["high"]
    assert found["worn_depth_mean"]["over"] == "common length"
    assert [found[name]["unit"] for name in NAMES] == ["m", "m", "m", "m2", "1", "1"]
    assert found["shift"]["value"] == pytest.approx(-SHIFT, abs=0.1 * UM)
    assert found["worn_depth_max"]["value"] == pytest.approx(DEPTH, abs=0.1 * UM)
    page = read_page(out)
    assert page.index("the mean of the lost material over the common length.") < page.index(
        "<figure"
    )
    assert page.count("<figure ") == 3 == page.count('role="img" aria-label="')


def test_exact_given_shift_is_used(trace_pair):
    """A given shift in um is used: beyond the traces it gives no common place."""
    words = ("compare", *trace_pair, "--shift", f"{10_000 - SHIFT / UM:.1f} um", "--json")
    assert run_cli(*words).content["reference"] != "place"


@pytest.mark.long
def test_exact_scene_is_pressed_with_both_surfaces(trace_pair, tmp_path):
    """compare --scene has the measures of single runs with each trace, and a chart of both pressures."""
    scene = tmp_path / "scene.toml"
    pieces = (
        'length = "2 mm"\nwidth = "1 mm"\nheight = "1 mm"\nload = "100 N"\nsubstrate = "steel"\n'
    )
    scene.write_text(f"[contact]\n{pieces}[accuracy]\ntolerance = 0.1\n", "utf-8")
    out = tmp_path / "out"
    assert run_cli("compare", *trace_pair, "--scene", scene, "-o", out).code == 0
    assert ".partial" not in (out / "compare.json").read_text("utf-8")
    pressed = read_json(out / "compare.json")["pressed"]["measures"]
    assert {"pressure_peak", "normal_stiffness", "approach"} <= pressed.keys()
    assert "Pressure on the interface" in read_page(out)
    for side in ("before", "after"):
        file = f"contact.profile.file={out}/surface_{side}.csv"
        sets = ("--set", file, "--set", "contact.profile.heights=surface")
        assert run_cli("run", scene, *sets, "--no-page", "-o", tmp_path / side).code == 0
        measures = read_json(tmp_path / side / "summary.json")["measures"]
        for name, pair in pressed.items():
            assert pair[side] == measures[name]
