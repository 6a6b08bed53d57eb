"""Text files with two columns: all spellings give the same trace, and all other files are refused with a message."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
from traces import UM, draw_uneven_trace, format_trace

from patchfem.core import Missing, PatchfemError
from patchfem.surface import read_profile


def read_content(tmp_path, content, name="before.csv"):
    """Write the content to a file and return the trace that it contains."""
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_profile(path)


X, Z = draw_uneven_trace()
SPELLINGS = {
    "comma": format_trace(X, Z),
    "semicolon": format_trace(X, Z, "x [um]; z [um]", ";"),
    "tab": format_trace(X, Z, "x [um]\tz [um]", "\t"),
    "blanks": format_trace(X, Z, "x [um]   z [um]", "   "),
    "blanks before units": format_trace(X, Z, "x   [um]    z   [um]", " "),
    "two blanks before units": format_trace(X, Z, "x  [um],z  (um)  (levelled)"),
    "settings before the header": "Length 5 mm, Cutoff 0.8 mm\n" + format_trace(X, Z),
    "settings between semicolons": "Start 0 mm;End 5 mm\n" + format_trace(X, Z, "x [um];z [um]", ";"),
    "windows": format_trace(X, Z).replace("\n", "\r\n"),
    "mark": "\ufeff" + format_trace(X, Z),
    "micro sign": format_trace(X, Z, "x [µm],z [μm]"),
    "latin-1": format_trace(X, Z, "x [µm],z [µm]").encode("latin-1"),
    "utf-16": format_trace(X, Z).encode("utf-16"),
    "brackets": format_trace(X, Z, '"X (um)", "Z (um)"'),
    "header in a comment": "# stylus, 2.5 um tip\n\n" + format_trace(X, Z, "# x [um],z [um]"),
    "comments": "% one\n// two\n" + format_trace(X, Z) + "# end\n\n,\n",
    "empty columns behind": format_trace(X, Z, "x [um],z [um],,").replace("\n", ",,\n"),
    "columns swapped": format_trace(Z, X, "z [um],x [um]"),
    "from the far end": format_trace(X[::-1], Z[::-1]),
    "underscores": format_trace(X, Z, "x_um,z_um"),
    "strokes": format_trace(X, Z, "x/µm;z / um", ";"),
    "bars": format_trace(X, Z, "x [um]|z [um]", "|"),
    "decimal comma": format_trace(X, Z, "x [um];z [um]", ";").replace(".", ","),
    "decimal comma and tabs": "# 2.5 um tip\n" + format_trace(X, Z, "x [um]\tz [um]", "\t").replace(".", ",") + "# 1.5\n",
    "decimal comma and blanks": format_trace(X, Z, "x [um], z [um]", "  ").replace(".", ","),
    "decimal comma in quotes": "x [um],z [um]\n" + "".join(f'"{a:.17g}","{b:.17g}"\n'.replace(".", ",").replace(
        '","', '"\x00"').replace("\x00", ",") for a, b in zip(X, Z)),
    "other delimiter in the header": format_trace(X, Z, "x [um] z [um]", ";"),
    "a blank line between rows": format_trace(X, Z).replace("\n", "\n\n"),
    "old macintosh": format_trace(X, Z).replace("\n", "\r"),
    "gzip": gzip.compress(format_trace(X, Z).encode()),
    "gzip of blanks": gzip.compress(format_trace(X, Z, "x [um] z [um]", " ").encode()),
}  # fmt: skip


@pytest.mark.parametrize("content", SPELLINGS.values(), ids=SPELLINGS)
def test_exact_all_spellings_give_same_trace(tmp_path, content):
    """All spellings of a text (separators, encodings, headers, decimal signs) give the same trace to the last bit."""
    profile = read_content(tmp_path, content)
    assert np.array_equal(profile.x, X * UM) and np.array_equal(profile.z, Z * UM)
    assert not profile.missing.any() and profile.notes == ()
    assert not profile.x.flags.writeable and not profile.z.flags.writeable


def test_exact_missing_heights_keep_their_positions(tmp_path):
    """Missing heights remain in the trace as missing samples."""
    profile = read_content(
        tmp_path, "x [um],z [um]\n0,1\n1,\n2,NaN\n3,***\n4, nan \n5,2\n6,*****\n7,1\n"
    )
    assert profile.missing.tolist() == [False, True, True, True, True, False, True, False]
    assert np.array_equal(profile.z[[0, 5, 7]], np.array([1.0, 2.0, 1.0]) * UM)


@pytest.mark.parametrize("step", [0.052, 0.37137, 7.3])
def test_exact_rounded_x_becomes_evenly_spaced(tmp_path, step):
    """Values of x that the file rounds become evenly spaced, with a note; exact values give no note."""
    x = np.arange(2000) * step
    z = np.random.default_rng(0).normal(size=2000)
    profile = read_content(
        tmp_path, "x [um],z [um]\n" + "".join(f"{a:.1f},{b:.5f}\n" for a, b in zip(x, z))
    )
    assert profile.x.size == 2000
    if step < 7:
        assert np.ptp(np.diff(profile.x)) < 1e-9 * step * UM
        assert profile.length == pytest.approx(x[-1] * UM, abs=0.1 * UM)
        assert (
            "x is rounded to 100 nm in the file; the samples are taken as evenly spaced by"
            in profile.notes[0]
        )
    else:
        assert profile.notes == ()


@pytest.mark.parametrize("steps", [(1.0, 1.4), (1.37, 0.63, 1.0)])
def test_exact_uneven_x_is_kept(tmp_path, steps):
    """Steps that are no multiples of their difference are uneven, and not even steps that a file has rounded."""
    x = np.cumsum(np.tile(steps, 30))
    profile = read_content(tmp_path, format_trace(x, np.sin(x)).encode())
    assert profile.x == pytest.approx(x * 1e-6, rel=1e-12) and not profile.notes


@pytest.mark.parametrize("setting", ["Length,10.0 um", "Length, 46.875 um", "Length,46.71875 um"])
def test_exact_rounded_x_below_any_length(tmp_path, setting):
    """A length in the header gives the step if it fits, with a blank behind the comma too, else the positions do."""
    rows = "".join(f"{0.15625 * k:.1f},{0.001 * (k % 3)}\n" for k in range(300))
    profile = read_content(tmp_path, f"{setting}\nx [um],z [um]\n{rows}")
    tolerance = 1e-3 if "10.0" in setting else 1e-12
    assert np.diff(profile.x) == pytest.approx(0.15625 * UM, rel=tolerance)
    assert len(profile.notes) == 1 and "x is rounded to 100 nm in the file" in profile.notes[0]
    exact_rows = "".join(f"{0.15625 * k},{0.001 * (k % 3)}\n" for k in range(300))
    assert read_content(tmp_path, f"{setting}\nx [um],z [um]\n{exact_rows}").notes == ()


SPELLED_UNITS = {
    "mils": 25.4e-6,
    "inch": 25.4e-3,
    "Inches": 25.4e-3,
    "pm": 1e-12,
    "A": 1e-10,
    "Å": 1e-10,
    "Angstrom": 1e-10,
    "Ångström": 1e-10,
    "micron": 1e-6,
    "microns": 1e-6,
    "Mikron": 1e-6,
    "µm": 1e-6,
    "metres": 1.0,
    "millimeter": 1e-3,
    "Mikrometer": 1e-6,
    "micrometers": 1e-6,
    "nanometre": 1e-9,
}


@pytest.mark.parametrize("word", SPELLED_UNITS)
def test_exact_unit_spellings_of_instruments(tmp_path, word):
    """The spellings of units that instruments use give the same heights."""
    heights = np.array([0, 2.54e-6, -2.54e-6])
    content = format_trace([0, 10, 20], heights / SPELLED_UNITS[word], f"x [um],z [{word}]")
    assert read_content(tmp_path, content).z == pytest.approx(heights, rel=1e-12)


GIVE = 'or state the units of x and z by --units "mm,um" (in Python, by units=("mm", "um"))'
WORDS = "{path}: no row of numbers in the first 1 lines; write the header as `x [um],z [um]` above rows of two numbers"
ORDER = ", but it must only rise or only fall; keep one trace or scan per file, and one height at each place"
REFUSED = {
    "": WORDS.replace("1 lines", "0 lines"),
    "\ufeff \n\n": WORDS.replace("1 lines", "2 lines"),
    "# only words\n% more\n": WORDS.replace("1 lines", "2 lines"),
    **dict.fromkeys(
        ("0,1\n1,2\n", "x,z\n0,1\n"),
        "{path}:1: the unit of x is not given, and units are never guessed; write the header as `x [um],z [um]`, "
        f"{GIVE}"),
    "0,0,1\n0,1,2\n": "{path}:1: the unit of x is not given, and units are never guessed; write the header as "
                      f"`x [um],z [um]`, {GIVE}",
    "\nx [um],z []\n0,1\n": "{path}:2: unknown unit '' of z; use one of m, km, cm, mm, um, nm, in, ft, mil",
    "x [um],z [furlong]\n0,1\n": "{path}:1: unknown unit 'furlong' of z; use one of m, km, cm, mm, um, nm, in, ft, mil",
    "x [um]\n0\n": "{path}:2: 1 columns of numbers, but x and z, or x, y and z, are needed; keep one trace of two columns "
                    "and write the header as `x [um],z [um]`",
    "x [um],y [um],z [um],w [um]\n0,0,1,1\n": "{path}:1: 4 columns of numbers, but x and z, or x, y and z, are needed; keep "
                                               "one trace of two columns and write the header as `x [um],z [um]`",
    "x [um],x [um]\n0,1\n": "{path}:1: the columns 'x [um]', 'x [um]' are not x, z, which are needed; write the header "
                            "as `x [um],z [um]`",
    "t [s],z [um]\n0,1\n": "{path}:1: the columns 't [s]', 'z [um]' are not x, z, which are needed; write the header "
                            "as `x [um],z [um]`",
    "x [um],z [um]\n": "{path}: 0 heights; a trace needs at least two",
    "x [um],z [um]\n0,1\n1,\n2,nan\n": "{path}: 1 heights; a trace needs at least two",
    "x [um],z [um]\n0,1\n1,2\n1.5\n": "{path}:4: '1.5': 2 numbers are needed; write nan for a missing height",
    "x [um],z [um]\n0,1\n1,2,3\n": "{path}:3: '1,2,3': 2 numbers are needed; write nan for a missing height",
    "x [um] z [um]\n0 1\n# c\n1\n": "{path}:4: '1': 2 numbers are needed; write nan for a missing height",
    "x [um];z [um]\n0;1\n1;2,5\n1.5;3\n": "{path}:4: '1.5;3': a decimal comma and a decimal point in one file; "
                                          "use the same sign in the whole file",
    "x [um];z [um]\n0;1\n1;1.234,5\n": "{path}:3: '1;1.234,5': a decimal comma and a decimal point in one file; "
                                         "use the same sign in the whole file",
    "x [um];z [um]\n999,5;1\n1,000;2\n1500,5;2\n": "{path}:3: x is 999.5 um and then 1 um" + ORDER,
    "x [um],z [um]\n0,0,1,5\n": "{path}:2: '0,0,1,5': 2 numbers are needed; with a decimal comma, separate the "
                                 "columns by semicolons or tabs",
    "x [um],z [um]\n0,1\n,2\n": "{path}:3: '' is not a number for x; correct the line, or write a missing height as nan",
    "x [um],z [um]\n0,1\n1,worn\n":
        "{path}:3: 'worn' is not a number for z; correct the line, or write a missing height as nan",
    "x [um],z [um]\n0,1\n1,1_0\n":
        "{path}:3: '1_0' is not a number for z; correct the line, or write a missing height as nan",
    "x [um],z [um]\n0,1\n1,\u0663\n":
        "{path}:3: '\u0663' is not a number for z; correct the line, or write a missing height as nan",
    "x [um],z [um]\n0,1\nnan,2\n3,1\n":
        "{path}:3: 'nan' is not a number for x; correct the line, or write a missing height as nan",
    "x [um],z [um]\n0,1\n1,2\n2,-inf\n":
        "{path}:4: '-inf' is not a number for z; correct the line, or write a missing height as nan",
    "x [um],z [um]\n0,1\n1,2\n2,1e999\n": "{path}:4: z is inf m; is the unit right? write a missing height as nan",
    "x [m],z [um]\n0,1\n12700,2\n": "{path}:3: x is 1.27e+04 m; is the unit right? write a missing height as nan",
    "x [mm],z [mm]\n0,1\n1,2\n2,99999\n": "{path}:4: z is 100 m; is the unit right? write a missing height as nan",
    "x [um],z [mm]\n0,1\n5,2\n10,1\n": "{path}: heights span 1 mm over a length of 10 um; is the unit of z right? If "
                                       "not, correct the header or give --units to profile and compare; write a "
                                       "missing height as nan",
    "x [nm],z [nm]\n0,0\n0.1,0\n": "{path}: the profile is 0.1 nm long; is the unit of x right?",
    "x [um],z [um]\n0,1\n1,2\n3,1\n2,2\n4,1\n": "{path}:5: x is 3 um and then 2 um" + ORDER,
    "x [um],z [um]\n4,1\n1,2\n2,1\n0,2\n": "{path}:4: x is 1 um and then 2 um" + ORDER,
    "x [um],z [um]\n0,1\n1,1\n1,2\n4,3\n": "{path}:4: x is 1 um and then 1 um" + ORDER,
    "x [um],y [um],z [um]\n": "{path}: 0 heights; a trace needs at least two",
    "x [um],y [um],z [um]\n0,0,1\n1,0,nan\n0,1,nan\n1,1,1.1\n": "{path}: 2 heights; a scan needs at least three",
    "x [um],z [um]\n5,1\n5,2\n": "{path}: every sample lies at x = 5 um; a surface needs at least two different x",
    "x [um],z [um]\n" + "1" * 2000: "{path}:2: '1111111111111111111111111111111111111...': 2 numbers are needed; "
                                    "write nan for a missing height",
    "a" * 2000: WORDS,
    "x [um],z [um]\n0,\x00\n": "{path}: not a text file; export the profile as text with two columns and write the "
                               "header as `x [um],z [um]`",
}  # fmt: skip


@pytest.mark.parametrize("content", REFUSED, ids=lambda content: repr(content[:30]))
def test_refuses_malformed_text_with_message(tmp_path, content):
    """A malformed text is refused with a message that states the line, the fault and the remedy."""
    with pytest.raises(PatchfemError) as caught:
        read_content(tmp_path, content)
    message = REFUSED[content].replace("{path}", str(tmp_path / "before.csv"))
    assert str(caught.value) == message


def test_exact_steep_heights_in_given_units_have_a_note(tmp_path):
    """Heights that span more than the length are read in the units of --units, with a note."""
    path = tmp_path / "a.csv"
    path.write_text("x [um],z [um]\n0,1\n1,900\n2,1\n", "utf-8")
    found = read_profile(path, ("um", "um"))
    assert found.notes == (
        f"{path}: heights span 899 um over a length of 2 um; are the units right?",
    )


@pytest.mark.usefixtures("small_text_limit")
def test_refuses_missing_damaged_and_large_files(tmp_path):
    """A missing file, a folder, a damaged .gz and a text that is too large are refused."""
    with pytest.raises(Missing, match="there is no such file"):
        read_profile(tmp_path / "none.csv")
    with pytest.raises(PatchfemError, match="the profile cannot be read"):
        read_profile(tmp_path)
    with pytest.raises(PatchfemError, match="cannot be read"):
        read_profile("a\0b")
    with pytest.raises(PatchfemError, match="cut off or damaged"):
        read_content(tmp_path, gzip.compress(format_trace(X, Z).encode())[:-20])
    bomb = gzip.compress(b"0" * (1 << 22))
    for content in (bomb, b" " * (1 << 21)):
        with pytest.raises(PatchfemError, match="more than 1 MiB of text; thin out the samples"):
            read_content(tmp_path, content)
