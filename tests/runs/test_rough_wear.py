"""Scenes whose rough layer wears: volume, limits, errors, areal heights, earlier runs and refusals."""

from functools import cache

import numpy as np
import pytest
from command_line import run_cli, run_successfully
from scene_runs import find_sentences
from scene_texts import COULOMB
from scipy.optimize import brentq
from traces import format_trace

import patchfem as pf
from patchfem.runs.wear import evolve
from patchfem.scene import loads

LOAD = 100.0
KAPPA = 1e-14
CYCLES = 1e5
VOLUME = KAPPA * LOAD * 40e-6 * CYCLES
PATCH = """\
[contact]
length = "10 mm"
width = "10 mm"
height = "5 mm"
load = "100 N"
substrate = "Ti-6Al-4V"
"""
TILT = '[contact.tilt]\nangle = "0.1 mrad"\n'
LAYER = '[contact.asperities]\nlaw = "exponential"\ndecay_length = "0.2 um"\n'
SLIDE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "100 Hz"\ncycles = 2\n'
WEAR = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1e5\n'
TOLERANCE = "[accuracy]\ntolerance = {}\n"
MOTION = COULOMB + SLIDE + WEAR
HARD = 'hardness = "3 GPa"\n'
FILE = 'heights = "heights.csv"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with rough heights as a trace and as a scan, and with a trace of waviness and roughness."""
    folder = tmp_path_factory.mktemp("rough_wear")
    random = np.random.default_rng(3)
    x = np.arange(0, 2000.0)
    heights = random.triangular(-1.2, 0.2, 1.2, x.size)  # without heights that look like spikes
    (folder / "heights.csv").write_text(format_trace(x, heights))

    x = np.arange(0, 10001, 5.0)
    z = 2 * np.cos(2 * np.pi * x / 10000) + 0.5 * random.normal(size=x.size)
    (folder / "long.csv").write_text(format_trace(x, z))

    axis = np.arange(64) * 5.0
    rows = [(place, y, height) for y in axis for place, height in zip(axis, random.normal(size=64))]
    np.savetxt(folder / "scan.csv", rows, delimiter=",", header="x [um],y [um],z [um]", comments="")
    return folder


@cache
def run_layer(folder, keys: str, shape: str = TILT, tolerance=1e-2, motion=MOTION):
    """Run a patch with a layer of these keys [contact.asperities]; tests share the result."""
    text = PATCH + shape + LAYER + keys + motion + TOLERANCE.format(tolerance)
    return pf.run(loads(text, folder / "scene.toml"))


def list_misses(result, reference) -> list[str]:
    """Return the names of the measures of wear that differ from a reference by more than the errors of both."""
    names = (
        "worn_volume",
        "worn_depth_max",
        "worn_depth_mean",
        "worn_top_height",
        "touching_fraction",
    )
    pairs = {name: (result.measures[name], reference.measures[name]) for name in names}
    return [
        name
        for name, (one, other) in pairs.items()
        if abs(one.value - other.value) > one.error + other.error
    ]


@pytest.mark.long
def test_exact_worn_layer_keeps_the_volume_and_loses_its_tops(folder):
    """The worn volume is kappa N s n to round-off; tops lose more than the mean depth, and touch where heights are cut.

    Without a hardness the layer does not wear, and the run has none of these measures.
    """
    worn = run_layer(folder, HARD + FILE)
    measures = worn.measures
    assert measures["worn_volume"].value == pytest.approx(VOLUME, rel=1e-12)
    mean = measures["worn_depth_mean"].value
    assert mean == pytest.approx(VOLUME / 1e-4, rel=1e-12)
    assert measures["worn_top_height"].value > 5 * mean
    assert 0.02 < measures["touching_fraction"].value < 0.5
    assert find_sentences(worn.notes, "worn_top_height is what its tops lose")

    old = run_layer(folder, "")
    assert "worn_top_height" not in old.measures
    assert old.measures["worn_depth_max"].value > 1.2 * measures["worn_depth_max"].value


def test_exact_layer_that_is_pressed_flat_wears_as_a_smooth_face(folder):
    """Under a pressure above the hardness all tops touch, and the face wears by the law without a layer that wears."""
    flat = run_layer(folder, 'hardness = "10 kPa"\n' + FILE).measures
    old = run_layer(folder, "").measures
    assert flat["touching_fraction"].value == pytest.approx(1)
    for name in ("worn_volume", "worn_depth_max", "pressure_peak"):
        assert flat[name].value == pytest.approx(old[name].value, rel=1e-9)


@pytest.mark.long
def test_always_errors_of_worn_layer_hold(folder):
    """Values at a tolerance of 3 % differ from those at 0.3 % by less than the errors of both."""
    coarse, fine = (run_layer(folder, HARD + FILE, tolerance=value) for value in (3e-2, 3e-3))
    assert list_misses(coarse, fine) == []
    assert fine.measures["worn_top_height"].error < 1e-2 * fine.measures["worn_top_height"].value


def test_exact_deepest_tops_lose_the_heights_above_their_level(folder):
    """The lost height is that of heights cut at half the worn depth of both pieces, by an integral over the heights."""
    run = run_layer(folder, HARD + FILE, shape="")
    x, heights = 1e-6 * np.loadtxt(folder / "heights.csv", delimiter=",", skiprows=1).T
    heights = heights - np.polyval(np.polyfit(x, heights, 1), x)
    measures = run.measures
    own = measures["worn_depth_max"].value / 2
    flat = np.sort(heights)[-int(np.ceil(LOAD / 1e-4 / 3e9 * heights.size))]
    level = brentq(
        lambda level: np.maximum(np.minimum(heights, flat) - level, 0).mean() - own,
        heights.min(),
        flat,
        xtol=1e-18,
    )
    assert measures["worn_top_height"].value == pytest.approx(flat - level, rel=1e-6)
    assert measures["touching_fraction"].value == pytest.approx(np.mean(heights > level), abs=2e-3)


@pytest.mark.long
def test_exact_split_trace_and_scan_give_the_heights(folder):
    """The short waves of the profile, and an areal scan beside [contact.area], are heights of a layer that wears."""
    profile = '[contact.profile]\nfile = "long.csv"\nheights = "surface"\n'
    split = run_layer(folder, 'cutoff = "1 mm"\n' + HARD, profile, 0.1).measures
    area = "[contact.area]\ncells = 32\n"
    linear = (
        '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e13 Pa/m"\nheights = "scan.csv"\n'
        + HARD
    )
    text = PATCH + TILT + area + linear + MOTION + TOLERANCE.format(0.1)
    face = pf.run(loads(text, folder / "scene.toml")).measures
    for measures in (split, face):
        assert measures["worn_volume"].value == pytest.approx(VOLUME, rel=1e-12)
        assert measures["worn_top_height"].value > 3 * measures["worn_depth_mean"].value
        assert 0 < measures["touching_fraction"].value < 1


@pytest.mark.long
def test_run_continues_and_compares(folder, tmp_path):
    """Two halves of a run agree with the whole, and `compare` gives the mean depth between them."""
    whole = run_layer(folder, HARD + FILE)
    text = PATCH + TILT + LAYER + HARD + FILE + MOTION + TOLERANCE.format(0.1)
    (folder / "scene.toml").write_text(text)
    half = {"wear.cycles": CYCLES / 2}
    pf.run(folder / "scene.toml", **half).save(tmp_path / "half")
    start = str(tmp_path / "half/result.nc")
    continued = pf.run(folder / "scene.toml", **half, **{"wear.start": start})
    for name in ("worn_volume", "worn_top_height", "touching_fraction"):
        value = whole.measures[name].value
        assert continued.measures[name].value == pytest.approx(value, rel=2e-2), name

    whole.save(tmp_path / "whole")
    run_successfully("compare", tmp_path / "half", tmp_path / "whole", "-o", tmp_path / "out")


@pytest.mark.parametrize(
    "text, code, message",
    [
        (PATCH + LAYER + HARD + MOTION, 2, "a layer that wears needs its heights"),
        (PATCH + LAYER + HARD + FILE, 0, "has a meaning only with [wear]"),
        (PATCH + LAYER + FILE + MOTION, 0, "needs contact.asperities.hardness"),
        (
            PATCH + LAYER + HARD + FILE.replace("heights.csv", "none.csv") + MOTION,
            2,
            "there is no file",
        ),
    ],
    ids=["no heights", "no wear", "no hardness", "no file"],
)
def test_refuses_layer_without_heights(folder, text, code, message):
    """A layer that wears without heights is refused, and keys without an effect are reported."""
    (folder / "wrong.toml").write_text(text)
    answer = run_cli("check", folder / "wrong.toml")
    assert answer.code == code and message in " ".join((answer.out + answer.err).split())


def test_refuses_to_resume_run_whose_heights_changed(folder, tmp_path, monkeypatch):
    """An interrupted run goes on only while the file of the heights of its layer is the same."""
    scene = tmp_path / "scene.toml"
    wear = WEAR + "jumps = 2\n"
    scene.write_text(
        PATCH + TILT + LAYER + HARD + FILE + COULOMB + SLIDE + wear + TOLERANCE.format(3e-2)
    )
    heights = (folder / "heights.csv").read_text()
    (tmp_path / "heights.csv").write_text(heights)
    save = evolve.save_wear_state

    def save_and_interrupt(*arguments):
        save(*arguments)
        raise KeyboardInterrupt

    command = ("run", scene, "-o", tmp_path / "out", "--no-page")
    with monkeypatch.context() as patched:
        patched.setattr(evolve, "save_wear_state", save_and_interrupt)
        assert run_cli(*command).code == 130

    rows = heights.splitlines(keepends=True)
    (tmp_path / "heights.csv").write_text("".join(rows[: len(rows) // 2]))
    answer = run_cli(*command, "--resume")
    assert answer.code == 2 and "a file that the scene names has changed" in answer.err
