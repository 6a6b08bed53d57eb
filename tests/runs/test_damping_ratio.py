"""`equivalent_damping` is a ratio of the first mode: how the mode is scaled does not enter, other modes leave none."""

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


def scene(
    law: str, method: str = "auto", slide: float = 1.0, more: str = "", drive: str = ""
) -> str:
    """A rig of 2 kg whose mode of 120 Hz is scaled so that it slides by `slide` per unit of its coordinate."""
    own = "" if method == "auto" else f'method = "{method}"'
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
base = {1 / slide}
{more}
[drive]
kind = "base"
frequency = "110 Hz"
{drive or 'acceleration = "2 g"' + chr(10) + "cycles = 30"}
[accuracy]
tolerance = 1e-2
{own}
"""


def ratio(result):
    """loop_area/(2 pi m w^2 Z^2) by the run's own modal coordinate, Z half of what it moves in a cycle, as written."""
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


@pytest.mark.share(0, 3, 4, 5, 6)
@pytest.mark.parametrize("law,method", ENGINES)
def test_exact_the_scale_of_a_mode_does_not_enter(law, method):
    """Twice the scale is exact in binary numbers, so nothing may change. At 2.5 times every number is rounded anew: an
    integrator of chosen steps may take another step somewhere, which moves forces by 2e-8 of the largest at most; the
    resonance makes 2e-7 of the amplitude of that, and the stiffness, far below that of the limit at the amplitude, is a
    difference of such forces. Processors differ in where they round."""
    plain, doubled, scaled = (
        pf.run(load(scene(law, method, slide))) for slide in (1.0, 2.0, SLIDE)
    )
    for name in (
        "equivalent_damping",
        "equivalent_stiffness",
        "loop_area",
        "relative_displacement_amplitude",
    ):
        a, b, c = (one.measures[name] for one in (plain, doubled, scaled))
        assert b.value == pytest.approx(a.value, rel=1e-13, abs=0), name
        rounded = (
            2e-8 * 3.6 / plain.measures["relative_displacement_amplitude"].value
            if (law, method, name) == ("tanh", "auto", "equivalent_stiffness")
            else 1e-12
        )
        chosen = 4e-7 if (law, method) == ("tanh", "auto") else 1e-7
        assert c.value == pytest.approx(a.value, rel=chosen, abs=rounded), name
    assert scaled.measures["equivalent_damping"].value == pytest.approx(ratio(scaled), rel=2e-3)


def test_exact_another_mode_that_slides_leaves_no_ratio():
    """At 110 Hz a mode of 300 Hz that slides as much carries some tenths of the slide; one of 0.001 does not."""
    second = '[[structure.mode]]\nname = "second"\nfrequency = "300 Hz"\ndamping = 0.02\nslide = {}\nbase = 0.9\n'
    shared, alone = (
        pf.run(load(scene("coulomb", slide=SLIDE, more=second.format(slide))))
        for slide in (2.5, 0.001)
    )
    part = shared.window.modal * shared.plan.model.rig.modes.slide
    share = np.ptp(part[:, 1]) / np.ptp(part.sum(axis=1))
    assert share > 0.05
    none = shared.measures["equivalent_damping"]
    assert none.value is None
    assert (
        none.reason
        == f"this measure is that of mode 1, but another mode contributes {100 * share:.2g} % of the slide"
    )
    assert alone.measures["equivalent_damping"].value == pytest.approx(ratio(alone), rel=2e-3)
