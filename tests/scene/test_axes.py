"""Axes of a sweep: lists and ranges of values in --over and [sweep]."""

import re

import numpy as np
import pytest
from scene_texts import BENCH

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.model import build
from patchfem.scene import (
    LIST_FORM,
    RANDOM_FORM,
    Range,
    loads,
    read_assignments,
)

SWEPT = BENCH + '[sweep]\n"friction.static" = "0.1..0.6:6"\nnormal.load = "26 lbf, 100 N"\n'


def read_axis(text, form=LIST_FORM):
    """Return the axis of a text that has no mistakes."""
    (found,), wrong = read_assignments([text], form)
    assert wrong == []
    return found


@pytest.mark.parametrize(
    "text, values, unit",
    [
        ("contact.tilt.angle=1e-6 rad..1e-2 rad:9", np.logspace(-6, -2, 9), "rad"),
        (
            "contact.tilt.angle=1e-6..1e-2 rad:9",
            np.logspace(-6, -2, 9),
            "rad",
        ),  # the unit of the end is that of both
        ("contact.tilt.angle=1 mrad..2 mrad:5", np.linspace(1e-3, 2e-3, 5), "rad"),
        (
            "contact.tilt.angle=1 mrad..10 mrad:3",
            np.geomspace(1e-3, 1e-2, 3),
            "rad",
        ),  # b/a = 10 is logarithmic
        ("contact.tilt.angle=0 rad..1 rad:3", [0, 0.5, 1], "rad"),
        ("contact.tilt.angle=1 mrad..100 mrad:3lin", [1e-3, 50.5e-3, 0.1], "rad"),
        ("contact.length=1 mm..1 in:3", np.geomspace(1e-3, 25.4e-3, 3), "m"),
        ("friction.static=0.1..0.6:6", [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], "1"),
        ("contact.load=26 lbf,100 N", [26 * 4.4482216152605, 100], "N"),
        (
            "contact.crown.radius=1 mm..3 mm:3, 5 mm",
            [1e-3, 2e-3, 3e-3, 5e-3],
            "m",
        ),
    ],
)
def test_exact_axis_values_in_si(text, values, unit):
    """The values of an axis agree with those in SI units within 1e-14."""
    found = read_axis(text)
    np.testing.assert_allclose(found.values, values, rtol=1e-14, atol=0)
    assert found.unit == unit and len(found.texts) == len(found.values)


def test_exact_axis_texts_are_valid_in_scene():
    """Each value of an axis has the text that a scene would contain."""
    assert read_axis("contact.load=26 lbf, 100 N").texts == ("26 lbf", "100 N")
    assert read_axis("contact.length=1 mm..3 mm:3").texts == ("1 mm", "2 mm", "3 mm")
    assert read_axis("friction.static=0.1..0.3:3").texts == ("0.1", "0.2", "0.3")
    assert read_axis("friction.law=coulomb,tanh").values == ("coulomb", "tanh")
    assert read_axis('drive.levels=["3 g", "4 g"],["5 g"]').texts == ('["3 g", "4 g"]', '["5 g"]')
    assert read_axis("slide.file=../a.csv,../b.csv").texts == ("../a.csv", "../b.csv")


@pytest.mark.parametrize(
    "text, says",
    [
        ("contact.load=5 lb", "did you mean 'lbf'"),
        ("contact.load=5", "a bare number without a unit"),
        ("contact.tilt.angle=1e-6..1e-2:9", "'1e-6' is a bare number"),
        ("contact.tilt.angle=1 mm..2 rad:9", "'mm' is a unit of length"),
        ("friction.static=0.1..0.6", "give the number of values after a colon"),
        ("friction.static=0.1..0.6:1", "from 2 to 3000000"),
        ("friction.static=0.1..0.6:10000000", "has 10000000 cases, more than the largest number"),
        ("friction.static=-1..2:3log", "both ends > 0"),
        ("friction.static=0.1..0.1:3", "both ends are the same"),
        ("friction.static=0.1,,0.2", "no value between"),
        ("contact.tilt.angle=1 mrad,0.001 rad", "is given twice"),
        ("contact.tilt.angle", "table.key=v1,v2"),
        ("angle=1 mrad", "did you mean 'contact.tilt.angle'?"),
        ("structure.mode.frequency=100 Hz", "structure.mode.NAME.frequency"),
        ("wear.jumps=ten", "use one of auto, or give a whole number"),
        ("wear.jumps=1.5", "one of auto, or a whole number, is needed, not 1.5"),
        ("friction.breakaway=1", "was removed in patchfem 1.4"),
    ],
)
def test_refuses_invalid_axis(text, says):
    """An invalid list or range is refused with its key and the mistake."""
    found, wrong = read_assignments([text])
    assert not found and len(wrong) == 1 and says in wrong[0] and text.partition("=")[0] in wrong[0]


def test_exact_sampled_values_lie_within_range():
    """Sampled values lie between the ends of a range, on a logarithmic or a linear scale."""
    log_range = read_axis("contact.tilt.angle=1 mrad..100 mrad", RANDOM_FORM)
    assert isinstance(log_range, Range) and log_range.is_log
    np.testing.assert_allclose(
        log_range.make_axis([0, 0.25, 0.5, 1]).values, [1e-3, 10**-2.5, 1e-2, 1e-1], rtol=1e-14
    )
    linear_range = read_axis("friction.static=0.2..0.6:lin", RANDOM_FORM)
    np.testing.assert_allclose(
        linear_range.make_axis([0, 0.25, 1]).values, [0.2, 0.3, 0.6], rtol=1e-14
    )
    assert (
        "takes whole numbers takes no range"
        in read_assignments(["contact.pairs=1..4"], RANDOM_FORM)[1][0]
    )
    assert "leave out :9" in read_assignments(["friction.static=0.2..0.6:9"], RANDOM_FORM)[1][0]


def test_exact_sweep_table_equals_options():
    """The table [sweep] gives the same axes as --over."""
    scene = loads(SWEPT, "a.toml")
    assert (
        list(scene.sweep)
        == read_assignments(["friction.static=0.1..0.6:6", "normal.load=26 lbf,100 N"])[0]
    )
    assert scene.effect_names()[-1] == "sweep" and loads(BENCH, "a.toml").sweep == ()


def test_always_values_of_all_axes_select_one_case():
    """The settings proposed by the refusal select one case; with an axis left, the refusal names only that axis."""
    with pytest.raises(PatchfemError) as error:
        pf.run(SWEPT)
    sets = re.findall(r'--set "([^"]*)"', str(error.value))
    scene = loads(SWEPT, "a.toml", sets)
    assert len(sets) == 2 and not scene.sweep
    assert build(scene).kind == "bench"
    with pytest.raises(PatchfemError) as second_error:
        build(loads(SWEPT, "a.toml", sets[:1]))
    assert sets[0] not in str(second_error.value) and sets[1] in str(second_error.value)
