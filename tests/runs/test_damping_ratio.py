"""The measure `equivalent_damping` refers to the first mode and does not depend on the scale of its
mode shape."""

import numpy as np
import pytest

import patchfem as pf
from patchfem import load

LAWS = {
    "coulomb": 'law = "coulomb"',
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "2 um"',
    "tanh": 'law = "tanh"\nreference_speed = "5 mm/s"',
}
ENGINES = (
    ("coulomb", "auto"),
    ("coulomb", "march"),
    ("coulomb", "harmonic"),
    ("elastic-plastic", "auto"),
    ("elastic-plastic", "harmonic"),
    ("tanh", "auto"),
    ("tanh", "march"),
)
SLIDE = 2.5


def format_rig(
    law: str, method: str = "auto", slide: float = 1.0, second_mode: str = "", drive: str = ""
) -> str:
    """Return a rig of 2 kg with a mode of 120 Hz whose sliding component is `slide` per unit of its
    coordinate."""
    method_key = "" if method == "auto" else f'method = "{method}"'
    return f"""
[normal]
load = "12 N"
[friction]
static = 0.3
{LAWS[law]}
[structure]
moving_mass = "{2 * slide**2} kg"
[[structure.mode]]
name = "first"
frequency = "120 Hz"
damping = 0.02
slide = {slide}
output = {slide}
base = {1 / slide}
{second_mode}
[drive]
kind = "base"
frequency = "110 Hz"
{drive or 'acceleration = "2 g"' + chr(10) + "cycles = 30"}
[accuracy]
tolerance = 1e-2
{method_key}
"""


def damping_from_loop_area(result):
    """Return loop_area/(2 pi m w^2 Z^2), where Z is half the peak-to-peak modal coordinate per
    cycle."""
    modal = result.window.modal[:, 0]
    time = result.window.time
    cycles = round((time[-1] - time[0]) * 110)
    half = np.mean(
        [
            np.ptp(modal[(time >= time[-1] - (k + 1) / 110) & (time <= time[-1] - k / 110)]) / 2
            for k in range(cycles)
        ]
    )
    mass = result.plan.model.rig.modes.mass
    return result.measures["loop_area"].value / (
        2 * np.pi * mass * (2 * np.pi * 120) ** 2 * half**2
    )


@pytest.mark.share(0, 4, 5)
@pytest.mark.parametrize("law,method", ENGINES)
def test_exact_damping_does_not_depend_on_mode_scale(law, method):
    """A scale of 2 is exact in binary arithmetic and changes nothing; a scale of 2.5 changes only
    round-off.

    With adaptive steps, round-off can change a step, and forces differ by at most 2e-8 of the
    largest. Near resonance the amplitude then differs by 2e-7. The stiffness is a difference of
    such forces and is far below the stiffness of the friction limit over the amplitude. Processors
    round differently.
    """
    unscaled, doubled, scaled = (
        pf.run(load(format_rig(law, method, slide))) for slide in (1.0, 2.0, SLIDE)
    )
    for name in (
        "equivalent_damping",
        "equivalent_stiffness",
        "loop_area",
        "relative_displacement_amplitude",
    ):
        base_measure, doubled_measure, scaled_measure = (
            result.measures[name] for result in (unscaled, doubled, scaled)
        )
        assert doubled_measure.value == pytest.approx(base_measure.value, rel=1e-13, abs=0), name
        abs_tol = (
            2e-8 * 3.6 / unscaled.measures["relative_displacement_amplitude"].value
            if (law, method, name) == ("tanh", "auto", "equivalent_stiffness")
            else 1e-12
        )
        rel_tol = 4e-7 if (law, method) == ("tanh", "auto") else 1e-7
        assert scaled_measure.value == pytest.approx(
            base_measure.value, rel=rel_tol, abs=abs_tol
        ), name
    assert scaled.measures["equivalent_damping"].value == pytest.approx(
        damping_from_loop_area(scaled), rel=2e-3
    )


def test_exact_second_sliding_mode_gives_no_damping_ratio():
    """A second mode of 300 Hz that contributes more than 5 % of the relative displacement leaves
    the measure without a value, with a reason; with a contribution of 0.001 the measure has its
    value."""
    second_mode = '[[structure.mode]]\nname = "second"\nfrequency = "300 Hz"\ndamping = 0.02\nslide = {}\nbase = 0.9\n'
    with_second_mode, with_first_mode = (
        pf.run(load(format_rig("coulomb", slide=SLIDE, second_mode=second_mode.format(slide))))
        for slide in (2.5, 0.001)
    )
    contributions = with_second_mode.window.modal * with_second_mode.plan.model.rig.modes.slide
    fraction = np.ptp(contributions[:, 1]) / np.ptp(contributions.sum(axis=1))
    assert fraction > 0.05
    damping = with_second_mode.measures["equivalent_damping"]
    assert damping.value is None
    assert (
        damping.reason
        == f"this measure is that of mode 1, but another mode contributes {100 * fraction:.2g} % of the slide"
    )
    assert with_first_mode.measures["equivalent_damping"].value == pytest.approx(
        damping_from_loop_area(with_first_mode), rel=2e-3
    )
