"""What is too long, too large or cannot be shown is refused at its line, before anything of its size is made."""

import time

import pytest
from scene_texts import BENCH, COULOMB, PATCH, POINT, RIG, STRUCTURE, list_mistakes

from patchfem.scene import Tables, load, loads
from patchfem.scene.keys.types import attributes_by_key, find_inner_table, iterate_annotation_parts
from patchfem.scene.scene import SceneError

MASSES = '[structure]\nmasses = [{}]\n[drive]\nkind = "base"\n'


def test_exact_every_whole_number_has_an_upper_bound():
    assert not list(_unbounded(Tables, ""))


def _unbounded(model, at):
    for key, name in attributes_by_key(model).items():
        inner = find_inner_table(model, name)
        if inner is not None:
            yield from _unbounded(inner, f"{at}{key}.")
            continue
        field = model.model_fields[name]
        found = [field.annotation, *field.metadata, *iterate_annotation_parts(field.annotation)]
        inside = [
            limit for one in found for limit in (one, *(getattr(one, "metadata", None) or ()))
        ]
        if int in found and not any(getattr(one, "le", None) for one in inside):
            yield f"{at}{key}"


@pytest.mark.parametrize("size", [10**18, 10**21, int("9" * 400)])
@pytest.mark.parametrize(
    "text, key",
    [
        (PATCH, "contact.pairs"),
        (PATCH, "contact.strips.count"),
        (RIG, "accuracy.steps_per_cycle"),
        (RIG, "accuracy.harmonics"),
        (RIG, "accuracy.shear_modes"),
        (BENCH + "[wear]\ncycles = 9\n", "wear.jumps"),
    ],
)
def test_refuses_whole_numbers_that_nothing_can_hold(text, key, size):
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
def test_refuses_numbers_that_overflow_what_is_made_of_them(text, sets, says):
    assert says in list_mistakes(text, sets)[0]


def test_refuses_signs_that_no_file_can_hold():
    found = list_mistakes(
        'title = "a\\u0000b"\n' + POINT + COULOMB + STRUCTURE.replace("axial", "ax\\u0007ial")
    )
    assert [one.split(", which")[0] for one in found] == [
        "a.toml:1: title: contains the character U+0000",
        "a.toml:10: structure.mode[1].name: contains the character U+0007",
    ]


def test_refuses_words_of_set_that_are_no_text():
    assert list_mistakes(PATCH, "contact.load=26 lbf\udcff") == [
        "--set: contact.load=26 lbf\\udcff: contains bytes that are not UTF-8 text; save the file as UTF-8"
    ]


@pytest.mark.parametrize("word", ["x" * 3000 + " = 1\n", "[" + "x" * 3000 + "]\n"])
def test_exact_a_long_name_is_cut(word):
    [message] = list_mistakes(POINT + COULOMB + STRUCTURE + word)
    assert len(message) < 300 and "x" * 40 in message and "...: unknown" in message


@pytest.mark.parametrize(
    "text, line",
    [
        (".".join("a" * 20_000) + " = 1\n", 1),
        (POINT + "[" + ".".join("a" * 20_000) + "]\n", 3),
        (POINT + "b = {" + ".".join("a" * 20_000) + " = 1}\n", 3),
    ],
)
def test_refuses_a_key_of_many_parts_at_once(text, line):
    begin = time.process_time()
    assert list_mistakes(text) == [f"a.toml:{line}: a key has more than 50 parts; write table.key"]
    assert time.process_time() - begin < 1  # the square of the parts: 30 s


def test_always_dots_in_a_text_are_no_parts():
    assert (
        loads(f'title = "{"a." * 200}"\n' + PATCH.replace("title =", "# title =")).title
        == "a." * 200
    )


def test_refuses_more_masses_than_can_be_solved_at_the_line_that_counts_them():
    [message] = list_mistakes("# many\n" + MASSES.format(", ".join(['"1 kg"'] * 20_000)))
    assert message.startswith("a.toml:3: structure.masses: 20000 entries are more")
    assert "9.6 GB" in message


@pytest.mark.slow
def test_always_twenty_thousand_mistakes_are_told_one_by_one():
    begin = time.process_time()
    found = list_mistakes(POINT + "".join(f"k{k} = 1\n" for k in range(20_000)))
    assert sum("unknown key" in one for one in found) == 20_000
    assert time.process_time() - begin < 5  # 1.3 s; each compared with all others: 40 s


def test_refuses_a_file_of_gigabytes_as_a_scene(tmp_path):
    path = tmp_path / "huge.toml"
    with open(path, "wb") as file:
        file.truncate(3 << 30)
    with pytest.raises(SceneError, match="more than 32 MiB"):
        load(path)
