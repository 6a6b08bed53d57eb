"""Rigs with a mode of negative damping: what holds, what grows, and the amplitude between."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.runs.batch import batches
from patchfem.runs.batch.lumped import lumped

SCENE = """
[normal]
load = "30 N"
[friction]
law = "{law}"
static = 0.3
{more}
[structure]
moving_mass = "0.5 kg"
[[structure.mode]]
name = "axial"
frequency = "120 Hz"
damping = {damping}
slide = 1.0
[structure.start]
displacement = ["{start} mm"]
[drive]
kind = "free"
cycles = {cycles}
"""
# mm: half swings lose 2 F/k and gain by exp(pi zeta/sqrt(1 - zeta^2))
EDGE = 1e3 * 9 / (0.5 * (240 * np.pi) ** 2) / np.tanh(np.pi * 0.02 / np.sqrt(1 - 0.02**2) / 2)


def text(**keys):
    given = {"law": "coulomb", "more": "", "damping": -0.02, "start": EDGE, "cycles": 60}
    return SCENE.format(**given | keys)


@pytest.mark.parametrize(
    "share, outcome", [(0.9, "stuck"), (0.999, "transient"), (1.001, "grows"), (1.1, "grows")]
)
def test_a_release_below_the_flutter_amplitude_comes_to_rest_and_one_above_it_grows(share, outcome):
    found = pf.run(pf.load(text(start=share * EDGE)))
    assert found.outcome == outcome
    edge = found.measures["flutter_amplitude"]
    assert edge.value == pytest.approx(1e-3 * EDGE, rel=1e-9) and edge.error <= 1e-8 * edge.value
    if outcome != "stuck":
        swing = found.measures["relative_displacement_amplitude"].value
        assert (swing < edge.value) == (share < 1)
    assert "10.08" not in "".join(found.notes) and "decays to rest" in found.notes[-1]


WEAKENS = {
    "normal": {"load": 100.0},
    "friction": {
        "law": "lugre",
        "static": 0.3,
        "kinetic": 0.2,
        "stiffness": 1e6,
        "stribeck_speed": 0.05,
    },
    "structure": {
        "moving_mass": 1.0,
        "mode": [{"name": "a", "frequency": 50.0, "damping": -0.01, "slide": 1.0}],
    },
    "drive": {"kind": "free", "cycles": 40.0},
}


@pytest.mark.share(1)
@pytest.mark.parametrize("share, grows", [(0.995, False), (1.005, True)])
def test_exact_the_edge_under_a_law_that_weakens_parts_releases_that_decay_from_those_that_grow(
    share, grows
):
    """No free motion can be followed from micro-slip on, so that there was no value. Releases from half a percent below
    and above part as the edge says; den Hartog's balance gives 12.90 mm with 0.2 alone."""
    done = pf.run(WEAKENS, **{"drive.displacement": share * 12.88e-3})
    end = done.measures["relative_displacement_amplitude"].value
    edge = done.measures["flutter_amplitude"]
    assert edge.value == pytest.approx(12.88e-3, rel=1e-3) and edge.error < 1e-3 * edge.value
    assert any("smaller motions could not be followed" in note for note in done.notes)
    assert end > 1.03 * edge.value if grows else end < 0.97 * edge.value


SECOND = '[[structure.mode]]\nname = "second"\nfrequency = "{} Hz"\ndamping = 0.02\nslide = 0.3\n[structure.start]\n'


@pytest.mark.filterwarnings("error")
def test_several_modes():
    """What rings while the interface holds may gain energy: the note promises no rest. A rigid mode has a reason."""
    two, rigid = (
        text(start=0.9 * EDGE)
        .replace("[structure.start]\n", SECOND.format(one))
        .replace(' mm"]', ' mm", "0 mm"]')
        for one in (400, 0)
    )
    found = pf.run(pf.load(two))
    edge = found.measures["flutter_amplitude"]
    assert edge.value == pytest.approx(1e-3 * EDGE, rel=0.1) and 0 < edge.error < 1e-6 * edge.value
    assert "a free oscillation of smaller amplitude decays, and" in found.notes[-1]
    edge = pf.run(pf.load(rigid)).measures["flutter_amplitude"]
    assert edge.value is None and "a mode of 0 Hz" in edge.reason


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "law", ["coulomb", 'elastic-plastic"\nbond_length = "20 um', 'tanh"\nreference_speed = "1 mm/s']
)
def test_a_motion_that_grows_past_all_bounds_ends(law):
    """Ten thousand cycles at exp(0.126) a cycle pass the largest number that there is."""
    found = pf.run(pf.load(text(law=law, start=1.1 * EDGE, cycles=10000)))
    assert found.outcome == "grows" and found.measures["flutter_amplitude"].value < 1.1e-3 * EDGE
    assert found.response.time[-1] < 2 and "when the motion exceeded 1000 m" in found.notes[-1]
    assert all(
        one.error is None for name, one in found.measures.items() if name != "flutter_amplitude"
    )


def test_without_friction_negative_damping_is_refused():
    lone = (
        text()
        .replace('[friction]\nlaw = "coulomb"\nstatic = 0.3\n', "")
        .replace('[normal]\nload = "30 N"\n', "")
    )
    with pytest.raises(
        pf.SceneError, match=r"damping: -0\.02 is negative damping, and without friction"
    ):
        pf.load(lone)
    with pytest.raises(pf.SceneError, match="damping: must be > -1"):
        pf.load(text(damping=-1.5))


def test_what_is_not_known_has_its_reason():
    still = text(
        law="nonlocal", more='bond_length = "20 um"\nreading = "report"', start=0.01, cycles=3
    )
    edge = pf.run(pf.load(still)).measures["flutter_amplitude"]
    assert edge.value is None and edge.reason


def test_cases_with_such_a_mode_run_by_themselves():
    driven = (
        text(cycles=40)
        .replace("[structure.start]\ndisplacement", "#")
        .replace('"free"', '"base"\nfrequency = "110 Hz"\nacceleration = "3 g"')
    )
    scenes = [pf.load(driven.replace("-0.02", damping)) for damping in ("-0.02", "0.02")]
    gains, loses = (pf.build(one) for one in scenes)
    assert "gain energy" in lumped.refuses(gains) and not lumped.refuses(loses)
    both = batches.solve_models([gains, loses])
    single = pf.run(scenes[0])
    assert both.outcome[0] == single.outcome
    for name in ("relative_displacement_amplitude", "flutter_amplitude"):
        assert both.values[name][0] == single.measures[name].value
    assert np.isnan(both.values["flutter_amplitude"][1])
