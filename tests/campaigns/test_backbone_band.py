"""Recommended curve of a backbone, its band and the advice, for scenes of a joint."""

import json

import numpy as np
import pytest

import patchfem as pf
from patchfem.__main__ import main
from patchfem.campaigns.backbone import words
from patchfem.campaigns.backbone.records import Backbone, make_band, make_curve

LAW = '[normal]\nload = "100 N"\n[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nbond_length = "60 um"\n'
SLIDE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "1 Hz"\n'
MODES = "100 Hz:0.005:0.5, 160 Hz:0.01:0.4"
STRUCTURE = """[structure]
moving_mass = "1 kg"
measured = "stuck"
[[structure.mode]]
name = "first"
frequency = "100 Hz"
damping = 0.005
slide = 0.5
output = 1.0
[[structure.mode]]
name = "second"
frequency = "160 Hz"
damping = 0.01
slide = 0.4
output = 1.0
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "1 g"
cycles = 20
"""
AMPLITUDES = np.geomspace(1e-5, 2e-3, 19)


@pytest.fixture(scope="module")
def both_curves():
    """Curves of two modes by both methods, with the modes given beside the scene of a bench."""
    return pf.backbone(LAW + SLIDE, modes=MODES, amplitudes=AMPLITUDES)


def test_exact_modes_as_argument_and_in_scene_give_same_curves(both_curves):
    """Modes given as an argument and modes in the scene of a rig give the same curve within 1e-9.

    Notes state which tables of the scene are ignored and that a modal mass is assumed.
    """
    backbone = pf.backbone(LAW + STRUCTURE, amplitudes=AMPLITUDES[::6])
    assert backbone.balance_frequency.values == pytest.approx(
        both_curves.balance_frequency.values[::6], rel=1e-9
    )
    assert backbone.attrs["stuck_frequency"] == pytest.approx(100)
    for curves, sentence in (
        (both_curves, "[slide] is ignored"),
        (both_curves, "modal mass is assumed"),
        (backbone, "[drive] is ignored"),
    ):
        assert any(sentence in note for note in curves.attrs["notes"])


def test_band_is_errors_and_difference_of_methods(both_curves):
    """The band ends where the outermost curve with its error ends; the advice states where the methods differ."""
    backbone = both_curves
    assert backbone.attrs["method"] == "balance"
    advice = backbone.attrs["advice"]
    assert "The band of this curve holds the numerical error" in advice
    assert "Up to 105 um friction dissipates nothing" in advice
    assert "the sticking contact, friction would reach its limit at 120 um" in advice
    for name in ("frequency", "damping"):
        ends = []
        for sign in (-1, 1):
            curves = []
            for method in ("balance", "quasi_static"):
                amplitude = backbone[f"{method}_amplitude"].values
                value = backbone[f"{method}_{name}"] + sign * backbone[f"{method}_{name}_error"]
                curve = np.full(backbone.band_amplitude.size, np.nan)
                near = np.isclose(backbone.band_amplitude.values[:, None], amplitude, rtol=1e-7)
                curve[near.any(axis=1)] = value.values[near.any(axis=0)]
                curves.append(curve)
            ends.append((np.fmin, np.fmax)[sign > 0](*curves))
        assert backbone[f"band_{name}_low"].values == pytest.approx(ends[0], rel=1e-12)
        assert backbone[f"band_{name}_high"].values == pytest.approx(ends[1], rel=1e-12)


def test_band_of_one_method_is_its_error():
    """The band of a single curve is its numerical error."""
    backbone = pf.backbone(LAW + SLIDE, modes=MODES, amplitudes=AMPLITUDES[::6], method="balance")
    assert "it is widest at" in backbone.attrs["advice"]
    width = backbone.band_damping_high.values - backbone.band_damping_low.values
    assert width == pytest.approx(2 * backbone.balance_damping_error.values, rel=1e-6, abs=1e-15)


@pytest.mark.parametrize("method", ["decay", "all"])
def test_refuses_removed_method(method):
    """A method that was removed is refused with what to use instead."""
    with pytest.raises(pf.PatchfemError, match=f"'{method}' was removed in patchfem 1.3; "):
        pf.backbone(LAW + SLIDE, modes=MODES, method=method)


def test_new_joint_scene_has_a_backbone(tmp_path, monkeypatch, capsys):
    """The scene of `new joint` with two given modes has a backbone with a band and advice."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "joint.toml").write_text(pf.new("joint"), "utf-8")
    options = ("--modes", "120 Hz:0.01, 170 Hz:0.02", "--amplitudes", "9 um..1 mm:3")
    with pytest.raises(SystemExit) as ended:
        main(["backbone", "joint.toml", "--json", "--no-page", *options])
    assert not ended.value.code
    answer = json.loads(capsys.readouterr().out)
    assert set(answer["band"]) == {
        "amplitude", "frequency_low", "frequency_high", "damping_low", "damping_high"
    }  # fmt: skip
    assert answer["stuck_frequency"] == pytest.approx(120, rel=1e-4)
    assert set(answer["curves"]) == {"balance", "quasi-static"}
    assert answer["advice"].startswith("Use the curve of method balance")
    # A patch in partial slip dissipates energy at each amplitude.
    assert "dissipates nothing" not in answer["advice"]
    for text in ("[slide] is ignored", "`slide` is assumed such", "assumed `slide` is positive"):
        assert any(text in note for note in answer["notes"])


def test_exact_drive_of_scene_is_ignored():
    """A scene whose [drive] is incomplete, or absent, gives the curve of the same scene with a drive."""
    text, _, drive = (LAW + STRUCTURE).partition("[drive]")
    curves = [
        pf.backbone(text + tail, amplitudes=[2e-5], method="quasi-static")
        for tail in ("[drive]" + drive, '[drive]\nkind = "free"\n', "")
    ]
    for name in ("quasi_static_frequency", "quasi_static_damping"):
        assert len({curve[name].item() for curve in curves}) == 1
    for curve, is_noted in zip(curves, (True, True, False)):
        assert any("[drive] is ignored" in note for note in curve.attrs["notes"]) == is_noted


@pytest.mark.parametrize(
    "scene, modes, message",
    [
        (LAW + SLIDE, "120", "'120': .*FREQUENCY:DAMPING"),
        (LAW + SLIDE, "120 mm:0.01", "120 mm.*frequency"),
        (LAW + SLIDE, "120 Hz:1 mm", "'1 mm' is neither a number nor a percentage such as '1 %'; write"),
        (LAW + SLIDE, [120, 0.01], "120: .*FREQUENCY:DAMPING"),
        (LAW + SLIDE, 120, "120: .*FREQUENCY:DAMPING"),
        (LAW + SLIDE, "120 Hz:0.01:0", "no slide of 0"),
        (LAW + SLIDE, [("120 Hz", 0.01, 40.0)], r"structure\.mode\[1\]\.slide.*multiply `slide`"),
        ('[structure]\nmasses = ["1 kg"]\n' + LAW + SLIDE, "9 Hz:0.01", "structure of masses"),
        (pf.build(LAW + STRUCTURE), "9 Hz:0.01", "cannot be given with a Model"),
    ],
)  # fmt: skip
def test_refuses_invalid_modes(scene, modes, message):
    """Modes with invalid text, units, slide or beside a structure of masses are refused."""
    with pytest.raises(pf.PatchfemError, match=f"(?s){message}"):
        pf.backbone(scene, modes=modes)


def test_exact_band_holds_the_other_curve_at_common_amplitudes_only():
    """The band is the numerical error where only one method has a value, and holds the other curve where both have one."""
    values = np.ones((4, 2))
    curves = {
        "balance": make_curve(np.array([1e-6, 2e-6]), values, 1e-3 * values),
        "quasi-static": make_curve(np.array([2e-6, 4e-6]), 1.1 * values, 1e-3 * values),
    }
    backbone = Backbone("a", None, curves, {}, None, None, (), make_band(curves))
    assert backbone.band.damping_high == pytest.approx([1.001, 1.101])
    assert backbone.band.damping_low == pytest.approx([0.999, 0.999])
    sentence = words.describe_band_width(backbone)
    assert "widest at 2 um, where the damping ratio is 0.999 to 1.101 beside 1" in sentence
    assert sentence.endswith("and the frequency is within 10 % everywhere.")


@pytest.mark.parametrize(
    "amplitudes, words_of_span",
    [
        ([3e-6, 4e-6, 9e-6], "from 3 um to 9 um"),
        ([3e-6], "at 3 um"),
        ([3e-6, 3.0001e-6], "at 3 um"),
    ],
)
def test_exact_span_of_missing_amplitudes_names_no_place_twice(amplitudes, words_of_span):
    """Amplitudes without a result lie between two places, or at one if both ends are the same in print."""
    assert words.describe_span(np.array(amplitudes)) == words_of_span
