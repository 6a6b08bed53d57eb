"""Scenes to start from: each is of the kind that it says, runs as it stands and misses no tolerance."""

import pytest

import patchfem as pf
from patchfem.core import Outcome, PatchfemError
from patchfem.scene.scene import load, loads
from patchfem.scene.starting import KINDS, shipped, text_of

ENDS = {"patch": Outcome.DONE, "joint": Outcome.DONE, "bench": Outcome.DONE, "rig": Outcome.STEADY,
        "linear": Outcome.STEADY, "wear": Outcome.DONE}


@pytest.mark.parametrize("kind", [pytest.param(kind, marks=[pytest.mark.slow] * (kind == "wear")) for kind in ENDS])
def test_always_it_runs_without_a_warning(kind):
    result = pf.run(loads(text_of(kind)))
    assert result.outcome == ENDS[kind] and not result.warnings


def test_exact_the_linear_scene_is_a_resonance_curve():
    """x = a/(w0² - w² + 2 i zeta w0 w) of the block against the base, off resonance."""
    from math import pi

    measured = pf.run(loads(text_of("linear"))).measures["relative_displacement_amplitude"]
    w0, w = 2 * pi * 143, 2 * pi * 140
    assert measured.value == pytest.approx(0.5 * 9.80665 / abs(w0**2 - w**2 + 2j * 0.003 * w0 * w), rel=1e-4)


def test_always_a_sweep_and_the_scene_of_the_rig_are_read():
    scene = loads(text_of("misalignment"))
    assert [axis.key for axis in scene.sweep] == ["contact.tilt.angle"] and scene.kind == "rig"
    assert load(shipped()).measured is not None
    assert set(KINDS) == {*ENDS, "misalignment"}


def test_refuses_a_kind_that_is_not_there():
    with pytest.raises(PatchfemError, match="joitn: no kind of scene; did you mean 'joint'"):
        text_of("joitn")
