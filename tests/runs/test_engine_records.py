"""Engines are what their records say: one table of what each takes."""

from itertools import product

from patchfem.effects import LAWS, SINE_WAVEFORM, WAVEFORMS
from patchfem.runs import ENGINES
from patchfem.scene import Friction, Joint, MotionFeatures, find_unsupported_feature
from patchfem.scene.rules.methods import ENGINE_SUPPORT, FEATURE_FINDERS

LEVELS = WAVEFORMS["levels"]


def test_always_every_engine_has_a_row_of_what_it_takes():
    assert set(ENGINES) == set(ENGINE_SUPPORT)
    for support in ENGINE_SUPPORT.values():
        assert set(support.features.split()) <= set(FEATURE_FINDERS)


def motions():
    """Motions of every law with everything that may stand beside it."""
    for law, soft, varies, yaws, spring, waveform in product(
        LAWS,
        ("", "[contact.shear]"),
        ("", "with normal.amplitude"),
        (False, True),
        ("", "[structure.stiffening]", "[normal.grooves]"),
        (SINE_WAVEFORM, LEVELS),
    ):
        for count in (1, 2):
            yield MotionFeatures(
                [Joint(Friction(law=law, static=0.3), soft)] * count, varies, yaws, spring, waveform
            )


def reasons(m) -> list:
    """What the engines of method "exact" lack for a Motion."""
    return [
        find_unsupported_feature(name, m) for name, one in ENGINES.items() if one.method == "exact"
    ]


def test_exact_the_march_takes_all_that_others_lack():
    for m in motions():
        assert find_unsupported_feature("march", m) == ""
        if m.load_change or m.spring:
            assert all([*reasons(m), find_unsupported_feature("smooth", m)])
