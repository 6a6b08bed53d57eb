"""Numbers, texts and files that are too large are refused at their line, before memory is allocated for them."""

import time

import pytest
from scene_texts import (
    BENCH,
    COULOMB,
    FORCED,
    PAIR,
    PATCH,
    POINT,
    RIG,
    STRUCTURE,
    list_mistakes,
)

from patchfem.scene import Tables, loads
from patchfem.scene.keys.types import list_keys


def test_exact_every_whole_number_has_an_upper_bound():
    """Every whole number in the schema of a scene has an upper bound."""
    assert not list(unbounded_keys(Tables, ""))


def unbounded_keys(model, at):
    """Yield the keys of whole numbers without an upper bound in a table."""
    for name, key in list_keys(model).items():
        if key.inner is not None:
            yield from unbounded_keys(key.inner, f"{at}{name}.")
            continue
        found = [*key.types, *key.field.metadata]
        inside = [
            limit for one in found for limit in (one, *(getattr(one, "metadata", None) or ()))
        ]
        if int in found and not any(getattr(one, "le", None) for one in inside):
            yield f"{at}{name}"


@pytest.mark.parametrize("size", [10**21, int("9" * 400)])
@pytest.mark.parametrize(
    "text, key",
    [
        (PATCH, "contact.pairs"),
        (RIG, "accuracy.shear_modes"),
        (BENCH + "[wear]\ncycles = 9\n", "wear.jumps"),
    ],
)
def test_refuses_huge_whole_numbers(text, key, size):
    """A whole number of 1e18 or more is refused with its upper bound."""
    message = next(one for one in list_mistakes(text, f"{key}={size}") if f" {key}: " in one)
    assert "must be <= " in message and len(message) < 250


@pytest.mark.parametrize(
    "text, sets, says",
    [
        (
            PATCH,
            "contact.height=1e3 m",
            "contact.height: 1000 m is more than 10000 times contact.length",
        ),
        (
            PATCH,
            "contact.element_size=1e-300 m",
            "contact.element_size: elements of 1e-300 m on a length of 0.0127 m are more than 100000",
        ),
        (RIG, "friction.order=1e50", "friction.order: must be <= 100, not 1e+50"),
        (RIG, "accuracy.tail=1e49", "accuracy.tail: must be <= 1, not 1e+49"),
    ],
)
def test_refuses_numbers_that_overflow(text, sets, says):
    """Numbers from which an overflowing quantity is computed are refused."""
    assert says in list_mistakes(text, sets)[0]


TOO_MANY = "2001 values are too many; at most 2000 are possible; give the modes of a larger rig in structure.file"
MASSES = "[" + ", ".join(['"1 kg"'] * 2001) + "]"
SPRING = """{between = [1, 0], stiffness = '1 N/m'}"""


@pytest.mark.parametrize(
    "sets, says",
    [
        (
            f"structure.masses={MASSES}",
            f"structure.masses: {TOO_MANY}",
        ),
        (
            f"structure.mode=[{', '.join(['{}'] * 2001)}]",
            f"structure.mode: {TOO_MANY}",
        ),
        (
            "structure.spring.0.between=[1, 2, 3, 4]",
            "structure.spring[1].between: two whole numbers are needed, such as [1, 2], not 4 values",
        ),
    ],
)
def test_refuses_too_many_values_with_their_remedy(sets, says):
    """Too many masses or modes are referred to a file of arrays, and too many ends of a spring to the right number."""
    assert f"--set: {says}" in list_mistakes(PAIR + FORCED, sets)


def test_exact_rig_may_have_more_springs_than_coordinates():
    """The largest number of masses and modes is no limit of the number of springs."""
    scene = loads(PAIR + FORCED, sets=[f"structure.spring=[{', '.join([SPRING] * 2001)}]"])
    assert len(scene.structure.spring) == 2001


def test_refuses_control_characters():
    """Control characters in a title or a name are refused with their lines."""
    found = list_mistakes(
        'title = "a\\u0000b"\n' + POINT + COULOMB + STRUCTURE.replace("axial", "ax\\u0007ial")
    )
    assert [one.split(", which")[0] for one in found] == [
        "a.toml:1: title: contains the character U+0000",
        "a.toml:10: structure.mode[1].name: contains the character U+0007",
    ]


def test_always_many_mistakes_are_reported_in_linear_time():
    """10 000 mistakes are reported one by one in less than 2.5 s of CPU time."""
    begin = time.process_time()
    found = list_mistakes(POINT + "".join(f"k{k} = 1\n" for k in range(10_000)))
    assert sum("unknown key" in one for one in found) == 10_000
    # measured: 0.5 s; reading all keys of the table for each unknown one took 5.2 s
    assert time.process_time() - begin < 2.5
