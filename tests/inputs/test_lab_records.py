"""Records of instruments in SI units: every format gives the written numbers, and every fault has a message."""

import numpy as np
import pytest
from command_line import run_cli
from lab_files import INCH, SI, make_record, write_universal

from patchfem.core import PatchfemError
from patchfem.inputs import parse_requests, read_records, read_signal

TIME = np.arange(21) / 2000
SLIDE = 1e-5 * np.sin(200 * np.pi * TIME)
FORCE = 36 * np.cos(200 * np.pi * TIME)


@pytest.mark.parametrize("binary, spacing", [(0, 0), (0, 1), (1, 1)])
def test_exact_universal_file_layouts(tmp_path, binary, spacing):
    """Text and binary layouts of a universal file give the values to the digits that they contain."""
    datasets = [
        make_record(TIME, values, quantity_type, binary=binary, abscissa_spacing=spacing)
        for values, quantity_type in ((SLIDE, 8), (FORCE, 13))
    ]
    records = read_records(write_universal(tmp_path / "a.unv", [SI, *datasets]), [])
    assert records.values["force"] == pytest.approx(FORCE, rel=1e-11)
    assert records.values["time"] == pytest.approx(TIME, rel=1e-5)


@pytest.mark.parametrize("kind", [0, 9, 13])
def test_exact_force_of_universal_file_by_data_type(tmp_path, kind):
    """A force signal is the record of a force, of an exciting force, or of an unknown quantity, beside others.

    A missing quantity is refused.
    """
    sets = [SI, make_record(TIME, SLIDE, 12), make_record(TIME, FORCE, kind)]
    path = write_universal(tmp_path / "a.58", sets)
    assert np.array_equal(read_signal(path, "force")[1], FORCE)
    if kind:
        assert np.array_equal(read_signal(path, "acceleration")[1], SLIDE)
        with pytest.raises(PatchfemError, match="0 of the 3 datasets match"):
            read_signal(path, "velocity")


def test_exact_units_of_dataset_164_and_channel_labels(tmp_path):
    """Units of dataset 164 (inch, lbf) are converted; the unit of a channel label takes precedence."""
    datasets = [
        INCH,
        make_record(TIME, SLIDE / 0.0254, 8),
        make_record(TIME, FORCE / 4.4482216152605, 13),
        make_record(TIME, SLIDE, 12, ordinate_axis_units_lab="g"),
        make_record(TIME, SLIDE, 11, ordinate_axis_units_lab="?"),
    ]
    records = read_records(write_universal(tmp_path / "a.uff", datasets), [])
    assert records.values["displacement"] == pytest.approx(SLIDE, rel=1e-14)
    assert records.values["force"] == pytest.approx(FORCE, rel=1e-14)
    assert np.array_equal(records.values["acceleration"], SLIDE * 9.80665)
    assert records.values["velocity"] == pytest.approx(SLIDE * 0.0254, rel=1e-14)
    assert len(records.notes) == 1
    assert "'?' is not known; the unit of dataset 164 is used" in records.notes[0]
    without_units = read_records(
        write_universal(tmp_path / "b.uff", [make_record(TIME, FORCE, 13)]), []
    )
    assert (
        np.array_equal(without_units.values["force"], FORCE)
        and "read as SI" in without_units.notes[0]
    )


def test_exact_channels_by_label_node_and_number(tmp_path):
    """A channel can be chosen by its label, its node and direction, or its number."""
    datasets = [
        SI,
        make_record(TIME, SLIDE, 8, id1="upper", rsp_node=12),
        make_record(TIME, 2 * SLIDE, 8, id1="lower", rsp_dir=-1),
        make_record(TIME, FORCE, 0, id1="bridge"),
    ]
    path = write_universal(tmp_path / "a.uff", datasets)
    with pytest.raises(
        PatchfemError, match=r"2 channels contain displacement; choose .* 1 'upper' at 12:\+x"
    ):
        read_records(path, [])
    for source in ("upper", "12:+x", "1"):
        assert np.array_equal(
            read_records(path, parse_requests([f"displacement={source}"])).values["displacement"],
            SLIDE,
        )
    reversed_records = read_records(path, parse_requests(["displacement=lower,force=bridge [lbf]"]))
    assert np.array_equal(reversed_records.values["displacement"], -2 * SLIDE)
    assert "points along -x" in reversed_records.notes[0]
    assert np.array_equal(reversed_records.values["force"], FORCE * 4.4482216152605)
    with pytest.raises(
        PatchfemError, match=r"'bridge' has no unit; write --map \"force=CHANNEL \[N\]\""
    ):
        read_records(path, parse_requests(["force=bridge"]))


@pytest.mark.parametrize(
    "requests, message",
    [
        (["force"], "NAME=CHANNEL"),
        (["force=a [furlong]"], "one of N, kN"),
        (["force=a", "force=b"], "given twice"),
        (["force=nothing"], "no channel 'nothing'; the file has 1 '"),
    ],
)
def test_refuses_invalid_channel_map(tmp_path, requests, message):
    """An invalid channel map is refused with the request concerned."""
    path = write_universal(tmp_path / "a.uff", [SI, make_record(TIME, FORCE, 13)])
    result = run_cli(
        "import",
        path,
        "-o",
        tmp_path / "o.csv",
        *(f"--map={request}" for request in requests),
    )
    assert result.code == 2 and message in result.err and not (tmp_path / "o.csv").exists()


def replace_value(values, value=np.nan):
    """Return a copy of the values with one value replaced."""
    changed = np.array(values)
    changed[3] = value
    return changed


@pytest.mark.parametrize(
    "datasets, message",
    [
        ([SI], "no record over time"),
        (
            [make_record(replace_value(TIME, value=0.0), FORCE, 13)],
            ": sample 4: time 0 s is not later than",
        ),
        (
            [make_record(TIME, FORCE, 13), make_record(TIME + 1, SLIDE, 8)],
            "is sampled at other times than",
        ),
        ([make_record(TIME, FORCE + 1j, 13)], "complex"),
        ([make_record(TIME, FORCE, 0)], "no channel label names a quantity"),
        ([SI | {"length": 0.0}, make_record(TIME, FORCE, 13)], "must be > 0"),
    ],
)
def test_refuses_invalid_universal_record(tmp_path, datasets, message):
    """A universal file with invalid records is refused with its name and the reason."""
    result = run_cli(
        "import", write_universal(tmp_path / "a.uff", datasets), "-o", tmp_path / "o.csv"
    )
    assert result.code == 2 and message in result.err and str(tmp_path / "a.uff") in result.err


@pytest.mark.parametrize(
    "text, message",
    [
        ("1,2\n3,4\n5,6\n", ":1: a header like"),
        ("time [s],force\n0,1\n1,2\n", "'force' has no unit"),
        ("time [s],A\n0,1\n1,2\n", "no channel label names"),
    ],
)
def test_refuses_invalid_table_with_line_number(tmp_path, text, message):
    """An invalid table is refused with the line of the fault."""
    (tmp_path / "a.csv").write_text(text)
    result = run_cli("import", tmp_path / "a.csv", "-o", tmp_path / "o.csv")
    assert result.code == 2 and message in result.err and str(tmp_path / "a.csv") in result.err, (
        result.err
    )
