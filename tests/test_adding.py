"""The examples of ADDING.md (new laws, shapes, drives and measures) run as printed on the page."""

import re
from pathlib import Path

import adding
import numpy as np
import pytest
import xarray
from command_line import read_json, read_page
from scene_texts import FORCED, PAIR, RIG

from patchfem.core import G_N, Response

PAGE = (adding.PACKAGE / "ADDING.md").read_text("utf-8")
# a motion that becomes steady so early that it takes a few seconds in Python
SHORT = "--set drive.cycles=10 --set structure.mode.axial.damping=0.3"
WAVED = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "12.7 mm"
load = "115 N"
element_size = "63.5 um"
substrate = {young = "120 GPa", poisson = 0.3, density = "4400 kg/m^3"}
[contact.ripple]
height = "35 nm"
wavelength = "1.27 mm"
"""
# Scenes with their laws by name, and the keys of an effect; a small change of the load leaves the laws alike.
FACE = RIG[: RIG.index("[friction]")] + "{}" + RIG[RIG.index("[structure]") :]
EFFECTS = {
    "partial_slip": (FACE, "--set contact.shear={}"),
    "load": (
        '[normal]\nload = "115 N"\n{}' + RIG[RIG.index("[structure]") :],
        "--set 'normal.amplitude=0.01 N' --set 'normal.frequency=286 Hz'",
    ),
    "pitch": (FACE, "--set 'structure.mode.axial.pitch=0.002 rad/m'"),
    "interfaces": (PAIR + FORCED, ""),
}
LAW = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nbond_length = "1 um"\n'
NEW_LAW = 'law = "dahl"', 'stiffness = "2e7 N/m"', "exponent = 1"
SAME_LAW = 'law = "lugre"', 'stiffness = "2e7 N/m"', 'stribeck_speed = "1 m/s"'
AVERAGE = 115 / 12.7e-3**2  # mean pressure of this scene [Pa]
LIMIT, LENGTH = (
    0.3 * 115,
    0.3 * 115 / 2e7,
)  # friction limit [N] and length [m] of the law on the page


@pytest.fixture(scope="module")
def example_folder(tmp_path_factory):
    """Return a copy of the package with all examples except the law, where the commands of the page have run.

    Without a new law the copy uses the compiled code of the package.
    """
    folder = tmp_path_factory.mktemp("adding")
    page = PAGE[: PAGE.index("## A law")] + PAGE[PAGE.index("## A shape of the gap") :]
    adding.copy_package(folder, page)
    (folder / "waved.toml").write_text(WAVED, "utf-8")
    lines = [line for line in adding.find_commands(PAGE) if "dahl" not in line]
    assert sum(line.startswith(("run", "sweep")) for line in lines) == 5
    # two runs and one sweep write their reports, which take half of the time
    pages = ("-o hold", "-o rig", "-o rigs")
    lines = [
        line if line.startswith("new") or line.endswith(pages) else f"{line} --no-page"
        for line in lines
    ]
    adding.run_commands(folder, [*lines, "run waved.toml -o waved --no-page"])
    return folder


@pytest.fixture(scope="module")
def law_folder(tmp_path_factory):
    """Return a copy of the package with all examples, where the new law has run in Python: nothing is compiled."""
    folder = tmp_path_factory.mktemp("law")
    adding.copy_package(folder, PAGE)
    run = next(line for line in adding.find_commands(PAGE) if line.endswith("-o rig_dahl"))
    run = run.replace("--set drive.cycles=800 ", "")
    lines = ["new rig -o rig.toml", run.replace("rig_dahl", f"dahl {SHORT} --no-page")]
    adding.run_commands(folder, lines, NUMBA_DISABLE_JIT="1")
    return folder


def read_measures(example_folder: Path) -> dict:
    """Return the measures in the summary of a results folder."""
    return read_json(example_folder / "summary.json")["measures"]


def test_always_examples_write_html_reports(example_folder):
    """Runs and sweeps with new measures and a new drive write reports; that of a run names the measures."""
    pages = {name: read_page(example_folder / name) for name in ("hold", "rig", "rigs")}
    assert all(len(page) > 10_000 for page in pages.values())
    assert "slide range" in pages["hold"] and "slide range" in pages["rig"]


def assert_loop_matches_closed_form(found: dict) -> None:
    """Assert that a steady loop of the law with n = 2 agrees with its closed form (page "My own law of friction")."""
    amplitude = found["slip_amplitude"]["value"], found["relative_displacement_amplitude"]["value"]
    x = amplitude[1] / LENGTH
    tip = (np.sqrt(1 + 4 * x**2) - 1) / (2 * x)
    area = 2 * LIMIT * LENGTH * (2 * x - np.log1p(2 * x * (1 + tip)))
    assert found["loop_area"]["value"] == pytest.approx(area, rel=2e-4)
    assert found["friction_force_peak"]["value"] == pytest.approx(LIMIT * tip, rel=2e-4)


def test_exact_law_of_page_agrees_with_closed_form(law_folder):
    """The loop area and the peak force of the added law agree with their closed form within 2e-4."""
    assert_loop_matches_closed_form(read_measures(law_folder / "dahl"))


def write_law(text: str, law: tuple) -> str:
    """Return a scene whose friction laws are replaced by the lines of another one."""
    kind, stiffness, last = law
    text = text.replace('law = "elastic-plastic"', f"{kind}\n{last}")
    return re.sub('bond_length = ".*"', stiffness, text)


@pytest.fixture(scope="module")
def marched_folder(tmp_path_factory):
    """Return a copy of the package with the law and its time steps, where both laws have run with each effect."""
    folder = tmp_path_factory.mktemp("marched")
    page = PAGE.replace('supports = "harmonic"', 'supports = "harmonic march"')
    assert page != PAGE
    steps = Path(__file__).with_name("added_law.md").read_text("utf-8")
    adding.copy_package(folder, page + steps)
    lines = []
    for effect, (text, keys) in EFFECTS.items():
        for name, law in (("new", NEW_LAW), ("same", SAME_LAW)):
            scene = f"{effect}_{name}"
            (folder / f"{scene}.toml").write_text(write_law(text.format(LAW), law), "utf-8")
            lines.append(
                f"run {scene}.toml {keys} --set accuracy.method=march --set drive.cycles=6 --no-page "
                f"-o {scene}"
            )
    sweep = lines[0].replace("run", "sweep", 1).removesuffix("partial_slip_new")
    lines.append(f"{sweep}sweep --over friction.static=0.2,0.3")
    adding.run_commands(folder, lines)
    return folder


@pytest.mark.long
@pytest.mark.parametrize("effect", EFFECTS)
def test_added_law_of_exponent_one_agrees_with_dahl_under_effect(marched_folder, effect):
    """By time steps the added law with n = 1 has the loop of Dahl's law, that of LuGre without damping."""
    found = read_measures(marched_folder / f"{effect}_new")
    other = read_measures(marched_folder / f"{effect}_same")
    for name in ("relative_displacement_amplitude", "loop_area"):
        error = found[name]["error"] + other[name]["error"]
        assert 0 < error < 5e-3 * other[name]["value"], name
        assert abs(found[name]["value"] - other[name]["value"]) <= error, name


@pytest.mark.long
def test_sweep_of_added_law_agrees_with_single_run(marched_folder):
    """A sweep of the added law has the loop area of the single run."""
    areas = xarray.load_dataset(marched_folder / "sweep/sweep.nc").loop_area.values
    single = read_measures(marched_folder / "partial_slip_new")["loop_area"]
    assert areas[1] == pytest.approx(single["value"], abs=2 * single["error"])
    assert abs(areas[0] - areas[1]) > 10 * single["error"]


@pytest.mark.slow
def test_always_law_of_page_agrees_in_two_engines(law_folder):
    """Compiled event engine and harmonic balance give the same loop of the added law within their error estimates."""
    adding.run_commands(law_folder, [line for line in adding.find_commands(PAGE) if "dahl" in line])
    event_driven = read_measures(law_folder / "rig_dahl")
    found = read_measures(law_folder / "harmonic")
    assert_loop_matches_closed_form(event_driven)
    assert_loop_matches_closed_form(found)
    for name in ("relative_displacement_amplitude", "loop_area", "friction_force_peak"):
        one = found[name]
        other = event_driven[name]
        assert abs(one["value"] - other["value"]) <= one["error"] + other["error"], name


def test_refuses_march_of_law_without_return_map(law_folder):
    """Time steps of an added law are refused with a sentence that names the law."""
    keys = "friction.law=dahl", "friction.stiffness=2e7 N/m", "friction.exponent=2"
    words = [word for key in (*keys, "accuracy.method=march") for word in ("--set", f'"{key}"')]
    with pytest.raises(AssertionError, match="'march' for law 'dahl' is not supported yet"):
        adding.run_commands(law_folder, [f"check rig.toml {' '.join(words)}"])


def test_always_ripple_contact_fraction_agrees_with_westergaard(example_folder):
    """The contact fraction of the added ripple agrees with Westergaard's closed form within 10 %.

    The closed form is 2/pi asin(sqrt(p/p*)); the ends of the piece have little effect.
    """
    modulus = 120e9 / (1 - 0.3**2) / 2
    full = np.pi * modulus * 35e-9 / 2 / 1.27e-3
    touching = 2 / np.pi * np.arcsin(np.sqrt(AVERAGE / full))
    assert read_measures(example_folder / "waved")["contact_fraction"]["value"] == pytest.approx(
        touching, rel=0.1
    )


def test_always_files_and_histories_of_page_exist():
    """Every file that the page names exists, and it names every history that a measure can use."""
    made = "# new file ", "NAME"
    files = set(re.findall(r"`([\w./]+/[\w.]+|\w+\.(?:py|md|toml))`", PAGE))
    assert len(files) > 20
    for name in files:
        if not any(word in name or word + name in PAGE for word in made):
            places = (adding.PACKAGE, adding.PACKAGE / "friction", adding.PACKAGE.parent)
            assert any((place / name).exists() for place in places), name
    histories = [name for name in Response.__dataclass_fields__ if name != "extra"]
    assert not [name for name in histories if f"`{name}`" not in PAGE]


def test_refuses_shape_table_without_piece_key(tmp_path):
    """A scene with an added shape whose table lacks the key `on` is refused with the line of the table."""
    on = '    on: key(Piece, "the piece that carries the shape") = "upper"\n'
    assert on in PAGE
    adding.copy_package(tmp_path, PAGE.replace(on, ""))
    (tmp_path / "waved.toml").write_text(WAVED, "utf-8")
    with pytest.raises(AssertionError, match=r"waved.toml:8: contact.ripple: .* has no key `on`"):
        adding.run_commands(tmp_path, ["check waved.toml"])


def test_always_added_drive_gives_waveform_and_sweep(example_folder):
    """The base accelerates by 5 g for one second and then rests, and a sweep over the acceleration has three cases."""
    run = xarray.load_dataset(example_folder / "hold/result.nc")
    acceleration = run.base_acceleration.values
    late = run.time.values > 1.0001
    assert np.allclose(acceleration[~late & (run.time.values < 0.9999)], 5 * G_N)
    assert not acceleration[late].any()
    cases = xarray.load_dataset(example_folder / "holds/sweep.nc")
    assert cases.sizes["drive_acceleration"] == 3 and set(cases.outcome.values) <= {
        "stuck",
        "steady",
        "transient",
    }


def test_always_added_measures_agree_with_histories(example_folder, law_folder):
    """Range and rms of the added measures agree with the histories of the last ten of 200 cycles.

    Their error estimates are small, and a sweep contains them.
    """
    found = read_measures(example_folder / "rig")
    run = xarray.load_dataset(example_folder / "rig/result.nc")
    late = run.isel(time=run.time.values >= 190 / 143 * (1 - 1e-12))
    slide = late.relative_displacement.values
    assert found["slide_range"]["value"] == pytest.approx(np.ptp(slide), rel=1e-9)
    assert 0 <= found["slide_range"]["error"] < 1e-3 * found["slide_range"]["value"]
    event_driven = read_measures(law_folder / "dahl")["slide_range"]
    assert 0 < event_driven["error"] < 1e-3 * event_driven["value"]
    rms = found["friction_force_rms"]
    steady = np.sqrt(
        np.trapezoid(late.friction_force.values**2, late.time.values) / np.ptp(late.time.values)
    )
    assert abs(rms["value"] - steady) <= rms["error"] + 1e-9 * steady
    assert rms["error"] < 0.02 * rms["value"]
    assert (
        abs(found["slide_mean"]["value"])
        <= found["slide_mean"]["error"] + found["slide_mean"]["floor"]
    )
    cases = xarray.load_dataset(example_folder / "rigs/sweep.nc")
    assert cases.slide_range.values[-1] == pytest.approx(found["slide_range"]["value"], rel=1e-9)
    assert np.isfinite(cases.slide_range_error.values).all()
