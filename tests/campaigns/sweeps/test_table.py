"""Cases of a sweep from a table with a column per key and a row per case."""

import pytest

from patchfem.campaigns.sweeps.table import read_case_table


def write_table(tmp_path, text):
    """Write a table of cases and return its path."""
    path = tmp_path / "cases.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_exact_units_in_header_or_cells_are_read(tmp_path):
    """Units in the header and units in the cells give the same quantities; empty rows are skipped."""
    cases, mistakes = read_case_table(
        write_table(
            tmp_path,
            "contact.load [lbf], contact.tilt.angle,friction.static,friction.law\n"
            "26,1 mrad,0.3,coulomb\n\n10,2e-3 rad,0.3,tanh\n",
        )
    )
    assert mistakes == [] and cases.is_table and len(cases) == 2
    assert cases.texts(0) == ("26 lbf", "1 mrad", "0.3", "coulomb")
    load, tilt, static, law = cases.axes
    assert tuple(load.values) == (115.653761996773, 44.482216152605) and load.unit == "N"
    assert tuple(tilt.values) == (1e-3, 2e-3)
    assert tuple(static.values) == (0.3, 0.3)
    assert law.values == ("coulomb", "tanh")


def test_exact_list_item_keys_have_two_notations(tmp_path):
    """Keys of list items are read from the header with brackets and with dots."""
    for key in ("structure.interface[1].load", "structure.interface.0.load"):
        cases, mistakes = read_case_table(
            write_table(
                tmp_path, f"{key} [N],{key.replace('load', 'bond_length')}[um]\n2,0.3\n5,0.7\n"
            )
        )
        assert mistakes == [] and cases.axes[0].key == key and cases.texts(1) == ("5 N", "0.7 um")
        assert tuple(cases.axes[0].values) == (2.0, 5.0) and cases.axes[1].unit == "m"


def test_exact_result_columns_of_a_sweep_are_ignored(tmp_path):
    """Columns with results of an earlier sweep are ignored."""
    cases, mistakes = read_case_table(
        write_table(
            tmp_path,
            "contact.load,friction.law,outcome,loop_area,message,case\n"
            '26 lbf,tanh,failed,,"a, b",1f\n10 lbf,coulomb,steady,0.1,,2f\n',
        )
    )
    assert mistakes == [] and [axis.key for axis in cases.axes] == ["contact.load", "friction.law"]
    assert cases.texts(1) == ("10 lbf", "coulomb")


@pytest.mark.parametrize(
    "text, messages",
    [
        ("outcome,loop_area\nsteady,1\n", ["the first line must be a header such as"]),
        (
            "contact.load,outcome,loop_area\n1 N,steady\n",
            ["cases.csv:2: the number of cells must be 3 ("],
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
            ["cases.csv:1: contact.lod: unknown key; did you mean 'load'"],
        ),
        (
            "contact.load [N],contact.load\n1,2 N\n",
            ["cases.csv:1: contact.load: two columns have this key"],
        ),
        (
            "contact.load [N]\n1,2\n",
            ["cases.csv:2: the number of cells must be 1 ("],
        ),
        ("contact.load [N]\n", ["a header such as"]),
    ],
)
def test_refuses_invalid_tables_with_line_number(tmp_path, text, messages):
    """Each mistake in a table of cases is refused with its line."""
    cases, mistakes = read_case_table(write_table(tmp_path, text))
    assert cases is None and len(mistakes) == len(messages)
    for line, expected in zip(mistakes, messages):
        assert expected in line
