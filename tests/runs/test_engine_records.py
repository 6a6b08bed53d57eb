"""The table of engines lists the features that each engine supports."""

from itertools import product

from patchfem.effects import LAWS, SINE_WAVEFORM, WAVEFORMS
from patchfem.runs import ENGINES
from patchfem.scene import (
    ENGINE_SUPPORT,
    Friction,
    Joint,
    MotionFeatures,
    find_unsupported_feature,
)
from patchfem.scene.rules.methods import EXACT_SUPPORTS, FEATURE_FINDERS

LEVELS = WAVEFORMS["levels"]


def test_always_every_engine_lists_supported_features():
    """Every engine has a row of supported features, and every feature of a row is known."""
    assert set(ENGINES) == set(ENGINE_SUPPORT)
    for support in ENGINE_SUPPORT.values():
        assert set(support.features.split()) <= set(FEATURE_FINDERS)


def list_motion_features():
    """Yield the features of motions for every law and every combination of effects."""
    for law, shear, varies, yaws, spring, waveform in product(
        LAWS,
        ("", "[contact.shear]"),
        ("", "with normal.amplitude"),
        (False, True),
        ("", "[structure.stiffening]", "[normal.grooves]"),
        (SINE_WAVEFORM, LEVELS),
    ):
        for count in (1, 2):
            yield MotionFeatures(
                [Joint(Friction(law=law, static=0.3), shear)] * count,
                varies,
                yaws,
                spring,
                waveform,
            )


def list_missing_features(motion) -> list:
    """Return the features of a motion that each engine of the method "exact" lacks."""
    return [find_unsupported_feature(support, motion) for support in EXACT_SUPPORTS]


def test_exact_march_supports_every_feature():
    """The march supports every combination; a varying load or a stiffening spring has no other
    engine."""
    for motion in list_motion_features():
        assert find_unsupported_feature(ENGINE_SUPPORT["march"], motion) == ""
        if motion.load_change or motion.spring:
            assert all(
                [
                    *list_missing_features(motion),
                    find_unsupported_feature(ENGINE_SUPPORT["smooth"], motion),
                ]
            )
