"""Engines are what their records say: one table of what each takes, hooks that exist, and no text that asks a name."""

from itertools import product

from patchfem.effects import LAWS, SINE, WAVEFORMS
from patchfem.runs.rig.engines import AUTOMATIC, ENGINES, FINDERS
from patchfem.scene.keys.tables import Friction
from patchfem.scene.rules.methods import BESIDE, TAKES, Motion, lacking

LEVELS = WAVEFORMS["levels"]


def test_always_every_engine_has_a_row_of_what_it_takes():
    assert set(ENGINES) == set(TAKES) and set(AUTOMATIC) <= set(ENGINES.values())
    for one in TAKES.values():
        assert set(one.beside.split()) <= set(BESIDE)
    assert {one.like for one in FINDERS.values()} <= set(ENGINES)


def motions():
    """Motions of every law with everything that may stand beside it."""
    for law, soft, varies, yaws, spring, waveform in product(
        LAWS,
        ("", "[contact.shear]"),
        ("", "with normal.amplitude"),
        (False, True),
        ("", "[structure.stiffening]", "[normal.grooves]"),
        (SINE, LEVELS),
    ):
        for count in (1, 2):
            yield Motion(
                [Friction(law=law, static=0.3)] * count,
                [soft] * count,
                varies,
                yaws,
                spring,
                waveform,
            )


def reasons(m) -> list:
    """What the engines of method "exact" lack for a Motion."""
    return [lacking(name, m) for name, one in ENGINES.items() if one.method == "exact"]


def test_exact_the_march_takes_all_that_others_lack():
    for m in motions():
        assert lacking("march", m) == ""
        if m.varies or m.spring:
            assert all([*reasons(m), lacking("smooth", m)])
