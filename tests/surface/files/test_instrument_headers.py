"""Text files of instrument programs: matrices under a header, and columns with names and units in separate lines.

The layouts are those of ASCII exports of Gwyddion, SPIP, Attocube, Nova and HFM. A file that is
refused with a remedy is read after the remedy is applied.
"""

import numpy as np
import pytest
from surfaces import assert_scan_equal, read_content

from patchfem.core import PatchfemError
from patchfem.surface import Profile
from patchfem.surface.files.content import fetch
from patchfem.surface.files.instruments import read_instrument
from patchfem.surface.files.table import make_surface

Z = np.arange(1.0, 13.0).reshape(3, 4)
ROWS = "1 2 3 4\n5 6 7 8\n9 10 11 12\n"
LONG_ROWS = np.random.default_rng(3).normal(size=(4, 300))


@pytest.mark.parametrize(
    "rows, encoding",
    [
        (ROWS, "utf-8"),
        (ROWS.replace(" ", "\t"), "utf-16"),
        (ROWS.replace(" ", "\t").replace("\n", "\t\n"), "latin-1"),
    ],
)
def test_exact_gwyddion_text(tmp_path, rows, encoding):
    """A Gwyddion text gives the same scan for all encodings, separators and decimal signs of its heights."""
    text = f"# Channel: Topo\n# Width: 4.000 µm\n# Height: 6.000 µm\n# Value units: nm\n{rows}"
    found = read_content(tmp_path, text, encoding=encoding)
    assert_scan_equal(found, (1e-6, 2e-6), Z * 1e-9)
    assert found.notes == ()
    with_comma = text.replace("\n1", "\n1,5", 1)
    assert_scan_equal(
        read_content(tmp_path, with_comma, encoding=encoding),
        (1e-6, 2e-6),
        np.where(Z == 1, 1.5, Z) * 1e-9,
    )


def test_exact_matrix_of_long_rows_with_missing_heights(tmp_path):
    """A matrix with rows of more than a thousand characters is read, with missing heights as nan, Bad, *** or empty."""
    z = np.where(np.arange(LONG_ROWS.size).reshape(LONG_ROWS.shape) % 97 == 5, np.nan, LONG_ROWS)
    header = "# Width: 300 µm\n# Height: 8 µm\n# Value units: um\n"
    rows = ["\t".join(repr(float(height)) for height in row) for row in z]
    for placeholder in ("nan", "Bad", "***", ""):
        text = header + "\n".join(rows).replace("nan", placeholder) + "\n"
        assert_scan_equal(read_content(tmp_path, text), (1e-6, 2e-6), z * 1e-6)
    assert_scan_equal(
        read_content(tmp_path, header + "\n".join(rows).replace("\t", ";").replace(".", ",")),
        (1e-6, 2e-6),
        z * 1e-6,
    )


def test_exact_sizes_agree_with_surface_topography(tmp_path):
    """A matrix below its sizes gives the same scan as SurfaceTopography within 1e-12."""
    pytest.importorskip("SurfaceTopography")
    ours = read_content(tmp_path, "# Width: 4.0 um\n# Height: 3.0 um\n# Value units: nm\n" + ROWS)
    theirs = make_surface(read_instrument(fetch(tmp_path / "scan.txt")))
    for name in ("x", "y", "z"):
        assert getattr(ours, name) == pytest.approx(getattr(theirs, name), rel=1e-12)


X = np.array([0.0, 0.5, 1.0, 1.5, 3.0])
H = np.array([0.25, -1.5, 0.75, 0.5, 0.0])
PAIRS = "".join(f"{a}\t{b}\n" for a, b in zip(X, H))
COUNTED = "".join(f"{k}\t{a}\t{b}\n" for k, (a, b) in enumerate(zip(X, H), 1))
QUOTED = "".join(f'"{a}","{b}"\n'.replace(".", ",") for a, b in zip(X, H))
TRACES = {
    "underscores and brackets": (f"X_(mm)\tHeight_(um)\n{PAIRS}", None),
    "x in um": (f"x in mm\tz in um\n{PAIRS}", None),
    "words and in": (f"Distance in mm\tHeight in µm\n{PAIRS}", None),
    "blanks and in": (f"x in mm z in um\n{PAIRS}".replace("\t", " "), None),
    "names and units in two lines": (f"Position\tHöhe\nmm\tµm\n{PAIRS}", None),
    "units in brackets in a line": (f"X\tZ\n[mm]\t[um]\n{PAIRS}", None),
    "a line of units alone": (f"mm\tMikrometer\n{PAIRS}", None),
    "words before": (
        f"Surface of the pad\nOperator: A. B.\n2026-01-05\nDistance [mm]\tProfile [um]\n{PAIRS}",
        None,
    ),
    "an index": (f"Index\tX [mm]\tZ [um]\n{COUNTED}", None),
    "names without units, quoted": ('"Distance","Profile"\n' + QUOTED, ("mm", "um")),
    "an index by name and no units": (f"Nr.\tWeg\tHöhe\n{COUNTED}", ("mm", "um")),
    "one unit alone": (f"µm\n{PAIRS}", ("mm", "um")),
    "x and y": (f"x [mm]\ty [um]\n{PAIRS}", None),
    "only numbers": (PAIRS, ("mm", "µm")),
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
@pytest.mark.parametrize("text, units", TRACES.values(), ids=TRACES)
def test_exact_traces_with_units_in_any_place(tmp_path, text, units, encoding):
    """A trace has the same numbers wherever the header gives its units, in UTF-8 and UTF-16."""
    found = read_content(tmp_path, text, units=units, encoding=encoding)
    assert isinstance(found, Profile) and found.x == pytest.approx(X * 1e-3, rel=1e-15)
    assert found.z == pytest.approx(H * 1e-6, rel=1e-15)


def test_exact_given_units_override_header_with_note(tmp_path):
    """Units that are given override those of the header, and a note states each difference."""
    found = read_content(tmp_path, f"x [um]\tz [um]\n{PAIRS}", units=("mm", "um"))
    assert found.x == pytest.approx(X * 1e-3) and found.z == pytest.approx(H * 1e-6)
    path = tmp_path / "scan.txt"
    assert found.notes == (
        f"{path}:1: the header gives x in um, but mm is used, as given by --units",
    )
    scan = read_content(
        tmp_path, f"# Width: 4 um\n# Height: 3 um\n# Value units: V\n{ROWS}", units=("mm", "um")
    )
    assert_scan_equal(scan, (1e-3, 1e-3), Z * 1e-6)
    assert scan.notes == (
        f"{path}: the header gives x in um, but mm is used, as given by --units",
        f"{path}: the header gives y in um, but mm is used, as given by --units",
        f"{path}: the header gives z in V, but um is used, as given by --units",
    )
    unknown_columns = read_content(tmp_path, f"Kanal A\tKanal B\n{PAIRS}", units=("mm", "um"))
    assert unknown_columns.notes == (
        f"{path}:1: columns 'Kanal A', 'Kanal B' are taken as x, z in this order",
    )


REMEDIES = {  # refused text, message, text after the remedy, and given units
    "a bare matrix": (
        ROWS,
        "the width of the scan is not given as a length above zero; write `# Width: 1.2 mm` and `# Height: 0.8 "
        "mm` and `# Value units: um` above its rows",
        "# Width: 1.2 mm\n# Height: 0.8 mm\n# Value units: um\n" + ROWS,
        None,
    ),
    "no height": (
        "# Width: 4 um\n# Value units: um\n" + ROWS,
        "the height of the scan is not given as a length above zero; write",
        "# Width: 4 um\n# Height: 0.8 mm\n# Value units: um\n" + ROWS,
        None,
    ),
    "no unit of the heights": (
        "# Width: 4 um\n# Height: 3 um\n" + ROWS,
        "the unit of z is not given, and units are never guessed; write `# Width: 1.2 mm`",
        "# Width: 4 um\n# Height: 3 um\n# Value units: nm\n" + ROWS,
        None,
    ),
    "no unit, but given": (
        "# Width: 4\n# Height: 3\n" + ROWS,
        'or state the units of x and z by --units "mm,um"',
        "# Width: 4\n# Height: 3\n" + ROWS,
        ("mm", "um"),
    ),
    "a width without unit": (
        "# Width: 4\n# Height: 3\n# Value units: um\n" + ROWS,
        "the unit of x is not given, and units are never guessed; write `# Width: 1.2 mm`",
        "# Width: 1.2 mm\n# Height: 0.8 mm\n# Value units: um\n" + ROWS,
        None,
    ),
    "volts": (
        "# Width: 4 um\n# Height: 3 um\n# Value units: V\n" + ROWS,
        "unknown unit 'V' of z; use one of m, km",
        "# Width: 4 um\n# Height: 3 um\n# Value units: nm\n" + ROWS,
        None,
    ),
    "a row cut off": (
        "# Width: 4 um\n# Height: 3 um\n# Value units: nm\n" + ROWS[:-6],
        ":6: '9 10': 4 numbers are needed; write nan for a missing height",
        "# Width: 4 um\n# Height: 3 um\n# Value units: nm\n" + ROWS[:-6] + " nan nan\n",
        None,
    ),
    "a word": (
        "# Width: 4 um\n# Height: 3 um\n# Value units: nm\n" + ROWS.replace("7", "lost"),
        ":5: 'lost' is not a number for z; correct the line, or write a missing height as nan",
        "# Width: 4 um\n# Height: 3 um\n# Value units: nm\n" + ROWS.replace("7", "nan"),
        None,
    ),
    "thousands": (
        "# Width: 4,000 um\n# Height: 3,000 um\n# Value units: nm\n" + ROWS,
        "the width of the scan is not given as a length above zero; write `# Width: 1.2 mm`",
        "# Width: 4000 um\n# Height: 3000 um\n# Value units: nm\n" + ROWS,
        None,
    ),
    "axes": (
        "# Width: 4 um\n# Height: 4 um\n# Value units: nm\n0 0 1 2 3\n0 3 1 4 1\n1 5 9 2 6\n2 5 3 5 8\n"
        "3 9 7 9 3\n",
        "the first row and the first column of the matrix grow evenly, like coordinates and not "
        "heights; leave out this row",
        "# Width: 4 um\n# Height: 4 um\n# Value units: nm\n3 1 4 1\n5 9 2 6\n5 3 5 8\n9 7 9 3\n",
        None,
    ),
    "two scans": (
        "# Width: 4 um\n# Height: 3 um\n# Value units: nm\n" + ROWS + "# Channel: Phase\n" + ROWS,
        ":7: '# Channel: Phase' ends the scan or begins another one; keep only one scan per file",
        "# Width: 4 um\n# Height: 3 um\n# Value units: nm\n" + ROWS,
        None,
    ),
    "names without units": (
        f"Distance\tProfile\n{PAIRS}",
        ":1: the unit of x is not given, and units are never guessed",
        f"Distance\tProfile\n{PAIRS}",
        ("um", "um"),
    ),
    "one unit for two columns": (
        f"µm\n{PAIRS}",
        ":2: the unit of x is not given, and units are never guessed",
        f"µm\n{PAIRS}",
        ("um", "um"),
    ),
    "one column": (
        "1\n2\n3\n",
        "1 columns of numbers, but x and z, or x, y and z, are needed; keep one trace",
        "x [um],z [um]\n0,1\n1,2\n4,3\n",
        None,
    ),
    "an index for x": (
        f"Index\tz [um]\n{PAIRS}",
        "1 columns of numbers, but x and z, or x, y and z, are needed; keep one",
        f"x [um]\tz [um]\n{PAIRS}",
        None,
    ),
    "an unknown name": (
        f"Kanal A [um]\tKanal B [um]\n{PAIRS}",
        "the columns 'Kanal A [um]', 'Kanal B [um]' are not x, z, which are needed; write the header as",
        f"x [um]\tz [um]\n{PAIRS}",
        None,
    ),
    "only words": (
        "Operator: me\nnothing\n",
        "no row of numbers in the first 2 lines; write the header as `x [um],z "
        "[um]` above rows of two numbers",
        f"x [um]\tz [um]\n{PAIRS}",
        None,
    ),
    "too steep": (
        f"x [um]\tz [mm]\n{PAIRS}",
        "is the unit of z right? If not, correct the header or give --units to profile and compare",
        f"x [um]\tz [mm]\n{PAIRS}",
        ("um", "mm"),
    ),
}


@pytest.mark.parametrize("faulty, message, corrected, units", REMEDIES.values(), ids=REMEDIES)
def test_refuses_faulty_text_with_valid_remedy(tmp_path, faulty, message, corrected, units):
    """A faulty text is refused with a remedy, and is read after the remedy is applied."""
    with pytest.raises(PatchfemError) as caught:
        read_content(tmp_path, faulty)
    assert message in str(caught.value) and str(tmp_path / "scan.txt") in str(caught.value)
    found = read_content(tmp_path, corrected, units=units)
    assert np.isfinite(found.z).sum() >= 3
