"""Recommended curve of a backbone, its band and the advice, for scenes of a joint."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.campaigns.backbone import words

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


@pytest.mark.long
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
