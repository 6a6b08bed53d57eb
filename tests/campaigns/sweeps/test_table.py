"""Cases from a file: a column per key, a case per row."""

import pytest

from patchfem.campaigns.sweeps.table import read_case_table


def written(tmp_path, text):
    path = tmp_path / "cases.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_exact_units_stand_in_the_header_or_in_the_cells(tmp_path):
    cases, wrong = read_case_table(
        written(
            tmp_path,
            "contact.load [lbf], contact.tilt.angle,friction.static,friction.law\n"
            "26,1 mrad,0.3,coulomb\n\n10,2e-3 rad,0.3,tanh\n",
        )
    )
    assert wrong == [] and cases.rows and len(cases) == 2
    assert cases.texts(0) == ("26 lbf", "1 mrad", "0.3", "coulomb")
    load, tilt, static, law = cases.axes
    assert load.values == (115.653761996773, 44.482216152605) and load.unit == "N"
    assert tilt.values == (1e-3, 2e-3)
    assert static.values == (0.3, 0.3)
    assert law.values == ("coulomb", "tanh")


def test_exact_items_stand_in_the_header_as_they_are_printed(tmp_path):
    for key in ("structure.interface[1].load", "structure.interface.0.load"):
        cases, wrong = read_case_table(
            written(tmp_path, f"{key} [N],{key.replace('load', 'bond_length')}[um]\n2,0.3\n5,0.7\n")
        )
        assert wrong == [] and cases.axes[0].key == key and cases.texts(1) == ("5 N", "0.7 um")
        assert cases.axes[0].values == (2.0, 5.0) and cases.axes[1].unit == "m"


def test_exact_the_answers_of_another_sweep_are_left_out(tmp_path):
    cases, wrong = read_case_table(
        written(
            tmp_path,
            "contact.load,friction.law,outcome,loop_area,message,case\n"
            '26 lbf,tanh,failed,,"a, b",1f\n10 lbf,coulomb,steady,0.1,,2f\n',
        )
    )
    assert wrong == [] and [axis.key for axis in cases.axes] == ["contact.load", "friction.law"]
    assert cases.texts(1) == ("10 lbf", "coulomb")


@pytest.mark.parametrize(
    "text, says",
    [
        ("outcome,loop_area\nsteady,1\n", ["the first line must be a header such as"]),
        (
            "contact.load,outcome,loop_area\n1 N,steady\n",
            ["cases.csv:2: the line must have 3 cells"],
        ),
        (
            "contact.load [lb]\n1\n2\n",
            ["cases.csv:2: contact.load: 'lb' is ambiguous", "cases.csv:3: contact.load"],
        ),
        (
            "contact.load [N],friction.static\n1 N,0.3\n2,a\n",
            [
                "cases.csv:2: contact.load: '1 N' must be a number",
                "cases.csv:3: friction.static: a plain number",
            ],
        ),
        (
            "contact.lod [N]\n1\n2\n",
            ["cases.csv:1: contact.lod: not a key of a scene; did you mean 'load'"],
        ),
        (
            "contact.load [N],contact.load\n1,2 N\n",
            ["cases.csv:1: contact.load: two columns have this key"],
        ),
        (
            "contact.load [N]\n1,2\n",
            ["cases.csv:2: the line must have 1 cells, as the header has, not 2"],
        ),
        ("contact.load [N]\n", ["a header such as"]),
    ],
)
def test_refuses_each_mistake_with_its_line(tmp_path, text, says):
    cases, wrong = read_case_table(written(tmp_path, text))
    assert cases is None and len(wrong) == len(says)
    for line, want in zip(wrong, says):
        assert want in line
