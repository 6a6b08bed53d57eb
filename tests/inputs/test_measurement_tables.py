"""Tables of measurements: Table 1 of the report, units, and messages about faulty tables."""

from math import pi
from pathlib import Path

import pytest

from patchfem.core import G_N, PatchfemError
from patchfem.inputs import read_slide, read_table
from patchfem.inputs.measured import FLAG_MEANINGS

TABLE_1 = Path(__file__).parents[2] / "studies/rig/table1.csv"
OMEGA = 2 * pi * 143
HEAD = "frequency [Hz],input [g],acceleration [g],displacement [mil],flag\n"


def test_table_1_interface_force_at_onset():
    """The interface force of a rigid block at 143 Hz and 4 g, a - x omega_n^2, is 4.83 g times its mass."""
    row = next(
        r
        for r in read_table(TABLE_1)
        if r.frequency == 143 and r.input == 4 * G_N and "R" not in r.flag
    )
    assert (row.acceleration - row.displacement * OMEGA**2) / G_N == pytest.approx(4.83, abs=0.01)


def test_exact_table_units_are_converted(tmp_path):
    """Units of a table of measurements are converted to SI, and missing cells are None."""
    path = tmp_path / "t.csv"
    path.write_text(
        "\ufeffinput [m/s^2], displacement [um],frequency [kHz],flag\n2,3,0.1,UR\n\n4,,0.2,\n",
        "utf-8",
    )
    first, second = read_table(path)
    assert (first.input, first.frequency, first.acceleration, first.flag) == (
        2.0,
        100.0,
        None,
        "UR",
    )
    assert first.displacement == pytest.approx(3e-6, rel=1e-15)
    assert (second.input, second.displacement, second.flag) == (4.0, None, "")
    assert set("UR") < set(FLAG_MEANINGS)


@pytest.mark.parametrize("text, message", [
    ("", ":1: {like}, not ''"),
    ("frequency [Hz],input [lb]\n", ":1: input [lb]: unknown unit; use one of m/s^2, mm/s^2, g"),
    ("frequency [Hz],speed [m/s]\n", ":1: {like}, not 'frequency [Hz],speed [m/s]' (no column input)"),
    (HEAD + "143,5,\"6,0\",,\n", ":2: acceleration: '6,0' has a decimal comma; export the file with decimal points"),
    (HEAD + "143,5,6.0,,\n143,5,6.0,,X\n", ":3: flag 'X'"),
    (HEAD + ",5,6.0,,\n", ":2: frequency and input are needed"),
    (HEAD + "1" * 200_000 + ",5,6,,\n", ":2: frequency: inf in SI is outside the computable range"),
    (HEAD + "1" * 200_000 + ",\"5\",6,,\n", ":2: the quotation marks in this row cannot be read (field larger than "
                                            "field limit"),
    (HEAD + "143,-5,6,,\n", ":2: input: '-5' is below 0"),
    ("frequency [Hz],input [g],flags\n143,5,U\n", ":1: column 'flags' is unknown; possible columns "
                                               "are flag and frequency"),
])  # fmt: skip
def test_refuses_faulty_measurement_table(tmp_path, text, message):
    """A faulty table of measurements is refused with the line of the fault."""
    path = tmp_path / "t.csv"
    path.write_text(text, "utf-8")
    with pytest.raises(PatchfemError) as caught:
        read_table(path)
    message = message.replace(
        "{like}",
        "a header like `frequency [Hz],input [g],acceleration [g],displacement [um],flag` is needed",
    )
    assert str(caught.value).startswith(f"{path}{message}")


@pytest.mark.parametrize("text", [
    "frequency [{}],input [g]\n143,5\n",
    "frequency [Hz],{}\n143,5\n",
    "frequency [Hz],input [g],{}\n143,5,1\n",
    HEAD + "143,5,{},,\n",
    HEAD + "143,5,-{},,\n",
    HEAD + "143,5,6,,{}\n",
    HEAD + "143,{}\n",
])  # fmt: skip
@pytest.mark.parametrize("word", ["1" * 300, "a" * 10_000, "a\x07" * 5_000])
def test_always_quoted_text_of_faulty_table_is_short(tmp_path, text, word):
    """A message about a long text in a table quotes only its beginning, in printable characters."""
    path = tmp_path / "t.csv"
    path.write_text(text.format(word), "utf-8")
    with pytest.raises(PatchfemError) as caught:
        read_table(path)
    message = str(caught.value)
    assert message.isprintable() and len(message) < 400 + len(str(path))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_exact_separators_and_brackets_of_units(tmp_path, separator):
    """Every table may separate its cells by commas, semicolons or tabs, and write units in either brackets."""
    path = tmp_path / "slide.csv"
    rows = [["time (ms)", '"displacement" [um]'], ["0", "0"], ['"500"', "2"]]
    path.write_text("\n".join(map(separator.join, rows)) + "\n")
    time, displacement = read_slide(path)
    assert time.tolist() == [0.0, 0.5] and displacement.tolist() == [0.0, 2e-6]
