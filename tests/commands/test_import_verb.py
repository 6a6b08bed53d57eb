"""The verb `import` with modes: a record, a decay or shapes become a [structure] that a scene runs with."""

import json
import tomllib

import numpy as np
import pytest
import pyuff
from command_line import run_cli
from lab_files import SI, make_record, write_universal
from lab_modes import OMEGA, RESIDUE, TIME, ZETA, driven_response, free_decay

from patchfem import build
from patchfem.core import PatchfemError
from patchfem.inputs import read_loop, read_signal, read_slide
from patchfem.structure import universal

HERTZ = OMEGA / (2 * np.pi)
AROUND = '[normal]\nload = "26 lbf"\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
FORCED = AROUND + '[drive]\nkind = "force"\nfrequency = "143 Hz"\nforce = "40 N"\ncycles = 5\n'
SHAKEN = AROUND + '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 5\n'


@pytest.fixture(scope="module")
def shaken(tmp_path_factory):
    """A force in N and the acceleration beside it in g."""
    force, response = driven_response("acceleration")
    return write_universal(
        tmp_path_factory.mktemp("lab") / "shaker.uff",
        [
            SI,
            make_record(TIME, force, 13, id1="cell"),
            make_record(TIME, response / 9.80665, 12, id1="tip", ordinate_axis_units_lab="g"),
        ],
    )


def test_always_a_note_shows_what_a_file_wrote_as_text(tmp_path):
    """A unit with a NUL byte once came to the screen as it stood, as would any sign that moves the cursor."""
    tip = make_record(
        TIME, driven_response("acceleration")[1], 12, id1="tip", ordinate_axis_units_lab="NO"
    )
    path = write_universal(tmp_path / "lab.uff", [SI, tip])
    path.write_bytes(path.read_bytes().replace(b"NO ", b"N\x1b "))
    answer = run_cli("import", path, "-o", tmp_path / "out.csv")
    assert answer.code == 0
    assert "its unit 'N?' is not known" in answer.err
    assert "\x1b" not in answer.err


def test_exact_one_table_of_all_channels_serves_slide_drive_and_fit(tmp_path):
    """Every channel that import knows may stand in it; each reader takes its own and passes over the others."""
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
    asked = [word for name in table for word in ("--map", f"{name.split()[0]}={name.split()[0]}")]
    plain = run_cli("import", source, "-o", out, *asked)
    assert plain.code == 0
    assert "time starts at 2 s, displacement starts at 3.89" in plain.err
    assert "--zero" in plain.err
    with pytest.raises(
        PatchfemError, match=r"table\.csv:2: time starts at 2: .*patchfem import --zero"
    ):
        read_slide(out)
    answer = run_cli("import", source, "-o", out, "--zero", *asked)
    assert answer.code == 0 and answer.err == ""
    assert read_slide(out) == (
        pytest.approx(time, abs=1e-12),
        pytest.approx(slide - slide[0], abs=1e-18),
    )
    assert read_signal(out, "acceleration")[1] == pytest.approx(0.0254 * np.cos(time), rel=1e-12)
    assert read_signal(out, "force")[1] == pytest.approx(4.4482216152605 * (time + 1), rel=1e-12)
    assert read_loop(out).reading == pytest.approx(4.4482216152605 * (time + 1), rel=1e-12)


def test_exact_modes_of_a_record_are_the_structure_of_a_scene(shaken, tmp_path):
    answer = run_cli("import", shaken, "-o", tmp_path / "modes.toml", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert [one["frequency"] for one in found["modes"]] == pytest.approx(HERTZ, rel=1e-8)
    assert [one["damping"] for one in found["modes"]] == pytest.approx(ZETA, rel=1e-6)
    assert any("widen the peak at 143 Hz" in note for note in found["notes"])
    text = (tmp_path / "modes.toml").read_text()
    modes = build(FORCED + text).rig.modes
    assert modes.omega == pytest.approx(OMEGA, rel=1e-8) and modes.mass == pytest.approx(
        1 / 1.2, rel=1e-6
    )
    assert modes.output**2 / modes.mass == pytest.approx(RESIDUE, rel=1e-6)
    assert "# modes of shaker.uff" in text and "the estimate from windowed segments gives" in text


def test_exact_a_band_keeps_the_mode_in_it_and_its_damping(shaken, tmp_path):
    answer = run_cli(
        "import",
        shaken,
        "-o",
        tmp_path / "modes.toml",
        "--band",
        "200 Hz..300 Hz",
        "--segment",
        "0.5 s",
    )
    assert answer.code == 0 and answer.out.count("Hz with a damping") == 1, answer.err
    (one,) = tomllib.loads((tmp_path / "modes.toml").read_text())["structure"]["mode"]
    assert one["damping"] == pytest.approx(ZETA[1], rel=1e-6)


def test_exact_the_response_written_is_read_by_structure_file(shaken, tmp_path):
    """Its modes carry the window's damping, which the record does not."""
    answer = run_cli("import", shaken, "-o", tmp_path / "response.uff", "--segment", "1 s")
    assert answer.code == 0 and "window hann" in answer.out, answer.err
    kinds = [
        one["func_type"]
        for one in pyuff.UFF(str(tmp_path / "response.uff")).read_sets()
        if one["type"] == 58
    ]
    assert kinds == [4, 6]
    shapes = universal.read_universal(tmp_path / "response.uff")
    at = np.argmin(np.abs(shapes.frequency - HERTZ[1]))
    assert shapes.frequency[at] == pytest.approx(HERTZ[1], rel=1e-3)
    answer = run_cli("import", tmp_path / "response.uff", "-o", tmp_path / "modes.toml")
    assert answer.code == 0 and "260" in answer.out, answer.err
    build(FORCED + (tmp_path / "modes.toml").read_text())


def test_exact_a_free_decay_of_a_table(tmp_path):
    time, place = free_decay()
    rows = [f"{t!r},{1e3 * p!r}" for t, p in zip(time.tolist(), place.tolist())]
    (tmp_path / "ring.csv").write_text("Time [s],LVDT [mm]\n" + "\n".join(rows) + "\n")
    answer = run_cli(
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
    assert answer.code == 0, answer.err
    assert "143 Hz with a damping of 0.004; 260 Hz with a damping of 0.01" in answer.out
    text = (tmp_path / "modes.toml").read_text()
    assert "set moving_mass" in answer.err and "logarithmic decrement 0.02513" in text
    modes = build(SHAKEN + text).rig.modes
    assert modes.zeta == pytest.approx(ZETA, rel=1e-7)


def test_exact_shapes_of_dataset_55_scaled_to_the_mass_they_hold(tmp_path):
    """Two masses of 1 and 3 kg: where both modes are known, a place holds its own mass whole, 1 / sum phi^2."""
    # (place, mode), orthonormal to the masses
    phi = np.array([[0.6, 0.8], [0.8, -0.6]]) / np.sqrt([[1.0], [3.0]])
    sets = [
        {
            "type": 55,
            "analysis_type": 2,
            "data_ch": 2,
            "spec_data_type": 8,
            "load_case": 1,
            "mode_n": k + 1,
            "node_nums": [11, 12],
            "r1": phi[:, k],
            "r2": np.zeros(2),
            "r3": np.zeros(2),
            "modal_m": 1.0,
            "freq": HERTZ[k],
            "modal_damp_vis": ZETA[k],
            "modal_damp_his": 0.0,
        }
        for k in range(2)
    ]
    path = write_universal(tmp_path / "shapes.uff", [SI, *sets])
    answer = run_cli("import", path, "-o", tmp_path / "modes.toml")
    assert answer.code == 2
    assert "give the node and direction that slide, such as --map slide=11:+x" in answer.err
    answer = run_cli(
        "import", path, "-o", tmp_path / "modes.toml", "--map", "slide=12:+x,output=11:+x"
    )
    assert answer.code == 0, answer.err
    modes = build(SHAKEN + (tmp_path / "modes.toml").read_text()).rig.modes
    assert modes.mass == pytest.approx(3, rel=1e-5)  # dataset 55 holds six digits
    assert modes.slide == pytest.approx(phi[1] * np.sqrt(3), rel=1e-5)
    assert modes.output == pytest.approx(phi[0] * np.sqrt(3), rel=1e-5)


@pytest.mark.parametrize(
    "words, says",
    [
        (["-o", "a.xlsx"], "modes as .toml"),
        (["-o", "a.csv", "--segment", "2 s"], "can be used only for modes"),
        (["-o", "a.toml", "--zero"], "--zero can be used only when importing a table"),
        (["-o", "a.uff", "--decay"], "can be used only for modes"),
        (["-o", "a.toml", "--segment", "2"], "--segment 2:"),
        (["-o", "a.toml", "--window", "flat"], "hann or none"),
        (["-o", "a.toml", "--band", "20 Hz"], "two rising frequencies"),
        (["-o", "a.toml", "--segment", "9 s"], "a segment"),
        (["-o", "a.toml", "--map", "acceleration=tip"], "one input (force or base_acceleration)"),
        (["-o", "a.toml", "--map", "slide=12:+x"], "--map slide: unknown; use"),
    ],
)
def test_refuses_by_name(shaken, tmp_path, monkeypatch, words, says):
    monkeypatch.chdir(tmp_path)
    answer = run_cli("import", shaken, *words)
    assert answer.code == 2 and says in answer.err and "internal fault" not in answer.err, (
        answer.err
    )
    assert not list(tmp_path.iterdir())
