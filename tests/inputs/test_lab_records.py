"""Records of instruments in SI: every format against the numbers that were written, every mistake named."""

import numpy as np
import pytest
from command_line import cli
from lab_files import INCH, SI, loop, record, written
from scipy.io import savemat

from patchfem.core import PatchfemError
from patchfem.inputs import parse_requests, read_loop, read_records, read_signal
from patchfem.inputs.units import find_unit_factor

TIME, SLIDE, FORCE = loop(20, 1)


def test_exact_a_universal_file_keeps_every_bit(tmp_path):
    found = read_records(
        written(tmp_path / "a.uff", [SI, record(TIME, SLIDE, 8), record(TIME, FORCE, 13)]), []
    )
    assert list(found.values) == ["time", "displacement", "force"] and not found.notes
    for name, truth in (("time", TIME), ("displacement", SLIDE), ("force", FORCE)):
        assert found.values[name].tobytes() == truth.tobytes()


@pytest.mark.parametrize("binary, spacing, digits", [(0, 0, 6), (0, 1, 6), (1, 1, 6)])
def test_exact_other_layouts_hold_what_their_text_holds(tmp_path, binary, spacing, digits):
    sets = [
        record(TIME, one, kind, binary=binary, abscissa_spacing=spacing)
        for one, kind in ((SLIDE, 8), (FORCE, 13))
    ]
    found = read_records(written(tmp_path / "a.unv", [SI, *sets]), [])
    assert found.values["force"] == pytest.approx(FORCE, rel=1e-11)
    assert found.values["time"] == pytest.approx(TIME, rel=10 ** (1 - digits))


def test_exact_units_of_dataset_164_and_of_labels(tmp_path):
    """In inches and lbf: 1/0.0254 inch is a metre; a label of the channel goes before the dataset."""
    sets = [
        INCH,
        record(TIME, SLIDE / 0.0254, 8),
        record(TIME, FORCE / 4.4482216152605, 13),
        record(TIME, SLIDE, 12, ordinate_axis_units_lab="g"),
        record(TIME, SLIDE, 11, ordinate_axis_units_lab="?"),
    ]
    found = read_records(written(tmp_path / "a.uff", sets), [])
    assert found.values["displacement"] == pytest.approx(SLIDE, rel=1e-14)
    assert found.values["force"] == pytest.approx(FORCE, rel=1e-14)
    assert np.array_equal(found.values["acceleration"], SLIDE * 9.80665)
    assert found.values["velocity"] == pytest.approx(SLIDE * 0.0254, rel=1e-14)
    assert len(found.notes) == 1
    assert "'?' is not known; the unit of dataset 164 is used" in found.notes[0]
    bare = read_records(written(tmp_path / "b.uff", [record(TIME, FORCE, 13)]), [])
    assert np.array_equal(bare.values["force"], FORCE) and "read as SI" in bare.notes[0]


def test_exact_channels_by_name_place_and_number(tmp_path):
    sets = [
        SI,
        record(TIME, SLIDE, 8, id1="upper", rsp_node=12),
        record(TIME, 2 * SLIDE, 8, id1="lower", rsp_dir=-1),
        record(TIME, FORCE, 0, id1="bridge"),
    ]
    path = written(tmp_path / "a.uff", sets)
    with pytest.raises(
        PatchfemError, match=r"2 channels contain displacement; choose .* 1 'upper' at 12:\+x"
    ):
        read_records(path, [])
    for source in ("upper", "12:+x", "1"):
        assert np.array_equal(
            read_records(path, parse_requests([f"displacement={source}"])).values["displacement"],
            SLIDE,
        )
    turned = read_records(path, parse_requests(["displacement=lower,force=bridge [lbf]"]))
    assert np.array_equal(turned.values["displacement"], -2 * SLIDE)
    assert "points along -x" in turned.notes[0]
    assert np.array_equal(turned.values["force"], FORCE * 4.4482216152605)
    with pytest.raises(
        PatchfemError, match=r"'bridge' has no unit; write --map \"force=CHANNEL \[N\]\""
    ):
        read_records(path, parse_requests(["force=bridge"]))


def test_exact_matlab_columns_by_an_explicit_map(tmp_path):
    savemat(
        tmp_path / "a.mat",
        {"t": 1e3 * TIME, "data": np.stack([SLIDE, FORCE], axis=1), "note": "text"},
    )
    found = read_records(
        tmp_path / "a.mat",
        parse_requests(["time=t [ms]", "displacement=data(:,1) [m]", "force=data(:,2) [N]"]),
    )
    assert np.array_equal(found.values["force"], FORCE) and np.array_equal(
        found.values["displacement"], SLIDE
    )
    assert np.array_equal(found.values["time"], 1e3 * TIME * 1e-3)


def test_exact_tables_of_instruments(tmp_path):
    """Semicolons, quotes, names with blanks, units in brackets or round ones, a column of remarks."""
    path = tmp_path / "a.csv"
    rows = [
        f"{t!r};{d * 1e3!r};{f!r};ok"
        for t, d, f in zip(TIME.tolist(), SLIDE.tolist(), FORCE.tolist())
    ]
    path.write_text('"Time (s)";"LVDT 1 [mm]";"Force [N]";remark\n' + "\n".join(rows) + "\n")
    found = read_records(path, parse_requests(["displacement=LVDT 1", "force=Force"]))
    assert np.array_equal(found.values["time"], TIME) and np.array_equal(
        found.values["force"], FORCE
    )
    assert found.values["displacement"] == pytest.approx(SLIDE, rel=1e-15)
    assert list(read_records(path, []).values) == ["time", "force"]


@pytest.mark.parametrize(
    "unit, factor",
    [
        ("m/s2", 1),
        ("m s-2", 1),
        ("m/s²", 1),
        ("m/s**2", 1),
        ("mm / s^2", 1e-3),
        ("g", 9.80665),
        ("in/sec2", 0.0254),
    ],
)
def test_exact_spellings_of_units(unit, factor):
    assert find_unit_factor("acceleration", unit) == factor


@pytest.mark.parametrize(
    "words, says",
    [
        (["force"], "NAME=CHANNEL"),
        (["mass=a"], "one of time, displacement"),
        (["force=a [furlong]"], "one of N, kN"),
        (["force=a", "force=b"], "given twice"),
        (["force=nothing"], "no channel 'nothing'; the file has 1 '"),
        (["force=3"], "no channel '3'"),
    ],
)
def test_refuses_maps_by_name(tmp_path, words, says):
    path = written(tmp_path / "a.uff", [SI, record(TIME, FORCE, 13)])
    answer = cli(
        "import",
        path,
        "-o",
        tmp_path / "o.csv",
        *(word for one in words for word in ("--map", one)),
    )
    assert answer.code == 2 and says in answer.err and not (tmp_path / "o.csv").exists()


def spoilt(values, at=3, to=np.nan):
    out = np.array(values)
    out[at] = to
    return out


@pytest.mark.parametrize(
    "sets, says",
    [
        ([SI], "no record over time"),
        ([record(spoilt(TIME, to=0.0), FORCE, 13)], "of sample 4 is not later than"),
        ([record(TIME, FORCE, 13), record(TIME + 1, SLIDE, 8)], "is sampled at other times than"),
        ([record(TIME, FORCE + 1j, 13)], "complex"),
        ([record(TIME, FORCE, 0)], "no channel label names a quantity"),
        ([SI | {"length": 0.0}, record(TIME, FORCE, 13)], "must be > 0"),
    ],
)
def test_refuses_universal_files_by_name(tmp_path, sets, says):
    answer = cli("import", written(tmp_path / "a.uff", sets), "-o", tmp_path / "o.csv")
    assert answer.code == 2 and says in answer.err and str(tmp_path / "a.uff") in answer.err


def test_refuses_values_that_are_not_finite(tmp_path):
    """pyuff writes them as 0, so the bytes of one value are replaced."""
    path = written(tmp_path / "a.uff", [record(TIME, SLIDE, 13)])
    path.write_bytes(path.read_bytes().replace(SLIDE[3].tobytes(), np.array(np.nan).tobytes()))
    with pytest.raises(PatchfemError, match=r"a\.uff: force of sample 4 is nan"):
        read_records(path, [])


@pytest.mark.parametrize(
    "text, says",
    [
        ("1,2\n3,4\n5,6\n", ":1: a header like"),
        ("time [s],force [N]\n0,1\n1\n", ":3: 1 cells, but 2 column names"),
        (
            "time [s];force [N]\n0;1\n1;2,5\n",
            ":3: force [N]: '2,5' has a decimal comma".replace(" [N]", ""),
        ),
        ("time [s],force [N]\n0,1\n1,nan\n", ":3: force: 'nan' is not a finite number"),
        ("time [s],force [lb]\n0,1\n1,2\n", "force [lb]: unknown unit"),
        ("time [s],force\n0,1\n1,2\n", "'force' has no unit"),
        ("time [s],A\n0,1\n1,2\n", "no channel label names"),
    ],
)
def test_refuses_tables_by_line(tmp_path, text, says):
    (tmp_path / "a.csv").write_text(text)
    answer = cli("import", tmp_path / "a.csv", "-o", tmp_path / "o.csv")
    assert answer.code == 2 and says in answer.err and str(tmp_path / "a.csv") in answer.err, (
        answer.err
    )


def test_refuses_other_files_and_spoilt_ones(tmp_path):
    savemat(tmp_path / "a.mat", {"t": TIME, "s": {"x": 1.0}, "wide": np.ones((3, 3))})
    (tmp_path / "b.uff").write_bytes(b"    -1\n    58\nnothing\n    -1\n")
    (tmp_path / "c.tdms").write_bytes(b"")
    for words, code, says in (
        (["a.mat"], 2, "assign the variables of the file"),
        (["a.mat", "--map", "force=F [N]"], 2, "no variable 'F'"),
        (["a.mat", "--map", "force=t"], 2, "has no units"),
        (["a.mat", "--map", "force=wide [N]"], 2, "wide(:,1)"),
        (["a.mat", "--map", "force=wide(:,4) [N]"], 2, "no column 4"),
        (["b.uff"], 2, "cannot be read"),
        (["a.mat", "--map", "force=s [N]"], 2, "no variable 's'"),
        (["c.tdms"], 2, "end in"),
        (["d.uff"], 4, "no such file"),
        (["d.mat"], 4, "no such"),
        (["d.csv"], 4, "no such"),
    ):
        answer = cli("import", tmp_path / words[0], *words[1:], "-o", tmp_path / "o.csv")
        assert answer.code == code and says in answer.err and "internal fault" not in answer.err, (
            answer.err
        )


def test_exact_what_is_imported_is_a_drive_and_a_loop(tmp_path):
    """An accelerometer in g that starts at 2 s drives a rig; --zero lets a slide start at 0, 0."""
    path = written(
        tmp_path / "a.uff",
        [
            SI,
            record(TIME + 2, np.cos(300 * TIME), 12, ordinate_axis_units_lab="g"),
            record(TIME + 2, SLIDE + 1e-6, 8),
            record(TIME + 2, FORCE, 13),
        ],
    )
    assert cli("import", path, "-o", tmp_path / "drive.csv", "--map", "acceleration=1").code == 0
    time, value = read_signal(tmp_path / "drive.csv", "acceleration")
    assert np.array_equal(value, np.cos(300 * TIME) * 9.80665) and np.array_equal(
        time, TIME + 2 - 2
    )
    words = ("--map", "displacement=2,force=3", "--zero")
    assert cli("import", path, "-o", tmp_path / "loop.csv", *words).code == 0
    found = read_loop(tmp_path / "loop.csv")
    assert found.time[0] == 0 and np.array_equal(found.reading, FORCE)
    assert np.array_equal(found.displacement, (SLIDE + 1e-6) - (SLIDE + 1e-6)[0])
