"""`patchfem import` of modes: a measured record, decay or set of mode shapes becomes a [structure] of a scene."""

import numpy as np
import pytest
from command_line import run_cli, run_successfully
from lab_files import SI, make_record, write_universal
from lab_modes import OMEGA, RESIDUE, TIME, ZETA, driven_response, free_decay

from patchfem import build
from patchfem.core import PatchfemError
from patchfem.inputs import read_loop, read_signal, read_slide

HERTZ = OMEGA / (2 * np.pi)
AROUND = '[normal]\nload = "26 lbf"\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
FORCED = AROUND + '[drive]\nkind = "force"\nfrequency = "143 Hz"\nforce = "40 N"\ncycles = 5\n'
SHAKEN = AROUND + '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 5\n'


@pytest.fixture(scope="module")
def measured_file(tmp_path_factory):
    """Return the path of a universal file with a force [N] and an acceleration [g]."""
    force, response = driven_response("acceleration")
    return write_universal(
        tmp_path_factory.mktemp("lab") / "shaker.uff",
        [
            SI,
            make_record(TIME, force, 13, id1="cell"),
            make_record(TIME, response / 9.80665, 12, id1="tip", ordinate_axis_units_lab="g"),
        ],
    )


def test_exact_imported_table_is_read_by_all_readers(tmp_path):
    """One imported table is read by the readers of slide, drive and loop.

    Every reader takes the channels that it needs.
    """
    time = np.arange(9) / 100
    slide = 1e-5 * np.sin(70 * time + 0.4)
    table = {
        "time [s]": time + 2,
        "displacement [mm]": 1e3 * slide,
        "velocity [in/s]": time,
        "force [lbf]": time + 1,
        "acceleration [in/s^2]": np.cos(time),
        "base_acceleration [g]": time,
    }
    source = tmp_path / "lab.csv"
    out = tmp_path / "table.csv"
    np.savetxt(
        source, np.transpose([*table.values()]), delimiter=",", header=",".join(table), comments=""
    )
    options = [f"--map={name.split()[0]}={name.split()[0]}" for name in table]
    run_successfully("import", source, "-o", out, *options)
    with pytest.raises(
        PatchfemError, match=r"table\.csv:2: time starts at 2: .*patchfem import --zero"
    ):
        read_slide(out)
    answer = run_successfully("import", source, "-o", out, "--zero", *options)
    assert answer.err == ""
    assert read_slide(out) == (
        pytest.approx(time, abs=1e-12),
        pytest.approx(slide - slide[0], abs=1e-18),
    )
    assert read_signal(out, "acceleration")[1] == pytest.approx(0.0254 * np.cos(time), rel=1e-12)
    assert read_signal(out, "force")[1] == pytest.approx(4.4482216152605 * (time + 1), rel=1e-12)
    assert read_loop(out).reading == pytest.approx(4.4482216152605 * (time + 1), rel=1e-12)


def test_imported_modes_agree_with_driven_oscillators(measured_file, tmp_path):
    """The modes of a record agree with those of the simulated oscillators.

    Frequencies agree within 1e-8, damping ratios and residues within 1e-6.
    """
    found = run_successfully(
        "import", measured_file, "-o", tmp_path / "modes.toml", "--json"
    ).content
    assert [one["frequency"] for one in found["modes"]] == pytest.approx(HERTZ, rel=1e-8)
    assert [one["damping"] for one in found["modes"]] == pytest.approx(ZETA, rel=1e-6)
    text = (tmp_path / "modes.toml").read_text()
    modes = build(FORCED + text).rig.modes
    assert modes.omega == pytest.approx(OMEGA, rel=1e-8) and modes.mass == pytest.approx(
        1 / 1.2, rel=1e-6
    )
    assert modes.output**2 / modes.mass == pytest.approx(RESIDUE, rel=1e-6)
    assert "# modes of shaker.uff" in text
    band = ("--band", "100 Hz..200 Hz", "--json")
    answer = run_cli("import", measured_file, "-o", tmp_path / "first.toml", *band)
    first = [one["frequency"] for one in answer.content["modes"]]
    assert first == pytest.approx(HERTZ[:1], rel=1e-3)


def test_exact_modes_of_free_decay(tmp_path):
    """Two modes from a free decay in a table agree with the true damping ratios within 1e-7."""
    time, place = free_decay()
    rows = [f"{t!r},{1e3 * p!r}" for t, p in zip(time.tolist(), place.tolist())]
    (tmp_path / "ring.csv").write_text("Time [s],LVDT [mm]\n" + "\n".join(rows) + "\n")
    answer = run_successfully(
        "import",
        tmp_path / "ring.csv",
        "--map",
        "displacement=LVDT",
        "--decay",
        "--begin",
        "0.01 s",
        "-o",
        tmp_path / "modes.toml",
    )
    assert "143 Hz with a damping of 0.004; 260 Hz with a damping of 0.01" in answer.out
    text = (tmp_path / "modes.toml").read_text()
    assert "set moving_mass" in answer.err and "logarithmic decrement 0.02513" in text
    modes = build(SHAKEN + text).rig.modes
    assert modes.zeta == pytest.approx(ZETA, rel=1e-7)


@pytest.mark.parametrize(
    "words, says",
    [
        (["-o", "a.xlsx"], "modes as .toml"),
        (["-o", "a.csv", "--band", "2 Hz..3 Hz"], "can be used only for modes"),
        (["-o", "a.toml", "--zero"], "--zero can be used only when importing a table"),
        (["-o", "a.toml", "--band", "20 Hz"], "two rising frequencies"),
        (["-o", "a.toml", "--map", "acceleration=tip"], "one input (force or base_acceleration)"),
        (["-o", "a.toml", "--map", "slide=12:+x"], "--map slide: unknown; use"),
    ],
)
def test_refuses_invalid_import_options(measured_file, tmp_path, monkeypatch, words, says):
    """Invalid options are refused with a message that names them, and no file is written."""
    monkeypatch.chdir(tmp_path)
    answer = run_cli("import", measured_file, *words)
    assert answer.code == 2 and says in answer.err and "internal fault" not in answer.err, (
        answer.err
    )
    assert not list(tmp_path.iterdir())
