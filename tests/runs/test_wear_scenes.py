"""Scenes with [wear]: volumes in closed form, the worn patch, shakedown, refusals and files."""

import io
from pathlib import Path

import numpy as np
import pytest
from command_line import read_json, run_cli, run_successfully
from scene_runs import run_scene
from scene_texts import (
    COATED,
    COULOMB,
    MODE,
    NONLOCAL,
    POINT,
    SHEAR,
    STRUCTURE,
)

import patchfem as pf
from patchfem.runs.wear import evolve

FOUND = Path(__file__).parent / "found"
TILTED = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n'
SINE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
WEAR = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 135723\n'
LOAD, KAPPA, CYCLES = 26 * 4.4482216152605, 1e-14, 135723
SOFT_RIG = (
    TILTED
    + SHEAR
    + NONLOCAL
    + MODE
    + '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 12\n'
)
LONG_WEAR = WEAR.replace("135723", "1e9").replace("1e-14", "1e-13")
WORN_THROUGH_SCENE = (
    TILTED + COULOMB + SINE + LONG_WEAR
)  # The coating is worn through before the last cycle.
LARGE_TOLERANCE = "[accuracy]\ntolerance = 2e-2\n"


def test_exact_worn_volume_is_coefficient_times_load_times_path():
    """The worn volume is kappa N s n within 1e-12; wear widens the contact, lowers the peak and keeps the loop."""
    worn = pf.run(TILTED + COULOMB + SINE + WEAR)
    volume = worn.measures["worn_volume"]
    assert volume.value == pytest.approx(KAPPA * LOAD * 40e-6 * CYCLES, rel=1e-12)
    assert 0 < volume.error <= 1e-3 * volume.value
    unworn = pf.run(TILTED + COULOMB + SINE)
    assert worn.measures["contact_fraction"].value > 1.4 * unworn.measures["contact_fraction"].value
    assert worn.measures["pressure_peak"].value < 0.6 * unworn.measures["pressure_peak"].value
    assert worn.measures["loop_area"].value == pytest.approx(
        unworn.measures["loop_area"].value, rel=1e-12
    )


@pytest.mark.parametrize("phase", [0, 45, 90])
def test_always_worn_volume_under_oscillating_load_is_integral_of_load_over_path(phase):
    """Under a load that oscillates with twice the frequency of the slide, the worn volume is kappa n times the integral of
    the load over the path, within its error. The integral was related to the load at the start of the last cycle in place
    of the mean load."""
    load = f'[normal]\nload = "100 N"\namplitude = "50 N"\nfrequency = "286 Hz"\nphase = "{phase} deg"\n'
    model = pf.build(load + COULOMB + SINE + WEAR)
    volume = pf.run(model).measures["worn_volume"]
    time = np.linspace(0, 1 / 143, 200_001)
    path = np.abs(np.diff(10e-6 * np.sin(2 * np.pi * 143 * time)))
    forces = model.point.evaluate(time)
    expected = KAPPA * CYCLES * float((forces[1:] + forces[:-1]) / 2 @ path)
    assert abs(volume.value - expected) <= volume.error + 1e-9 * expected
    assert volume.error <= 1e-3 * volume.value


def test_static_measures_after_wear_are_those_of_the_worn_patch():
    """After wear the pressure peak is that of the worn field within 1 %, with pieces that are elastic in shear.

    With [contact.shear] a bench stated the peak of the unworn patch, which is 2.7 times as high.
    """
    free = TILTED.replace('element_size = "0.5 mm"\n', "")
    result = pf.run(free + SHEAR + COULOMB + SINE + WEAR + "jumps = 6\n" + LARGE_TOLERANCE)
    largest = result.fields["normal_stress"][-1].max()
    assert result.measures["pressure_peak"].value == pytest.approx(largest, rel=1e-2)
    x = result.patch.x
    loaded = np.ptp(x[result.fields["normal_stress"][-1] > 0]) / np.ptp(x)
    assert result.measures["contact_fraction"].value == pytest.approx(loaded, rel=5e-2)


@pytest.mark.parametrize("motion", [SINE, STRUCTURE], ids=["bench", "rig"])
def test_point_contact_wear_agrees_with_archard(motion):
    """The worn volume of a point contact is kappa N 4 A n, on a bench and in a rig."""
    result = pf.run(POINT + COULOMB + motion + WEAR)
    amplitude = result.measures["slip_amplitude"].value
    assert result.measures["worn_volume"].value == pytest.approx(
        KAPPA * LOAD * 4 * amplitude * CYCLES, rel=2e-3
    )
    assert "worn_depth_max" not in result.measures


@pytest.mark.share(2, 3)
@pytest.mark.parametrize(
    "table",
    [
        '[contact.asperities]\nlaw = "exponential"\nnormal_stiffness = "1e13 Pa/m"\ndecay_length = "2.5 um"\n',
        '[contact.asperities]\nlaw = "hertz"\nradius = "10 um"\ndensity = "1e10 1/m^2"\nheight_deviation = "0.5 um"\n',
        '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e13 Pa/m"\n',
        '[contact.holder]\nrotational_stiffness = "1e4 N m/rad"\n',
        '[contact.crown]\nradius = "1 m"\n',
    ],
    ids=["exponential", "hertz", "linear", "holder", "crown"],
)
def test_exact_worn_volume_does_not_depend_on_skin_or_shape(table):
    """The worn volume is kappa N s n for every skin, holder and shape."""
    result = pf.run(TILTED + table + COULOMB + SINE + WEAR)
    assert result.measures["worn_volume"].value == pytest.approx(
        KAPPA * LOAD * 40e-6 * CYCLES, rel=1e-12
    )


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "slide, path",
    [
        ('kind = "constant"\nspeed = "5 mm/s"\ndistance = "50 um"', 50e-6),
        (
            'kind = "dwell"\nspeed = "5 mm/s"\ndistance = "50 um"\nhold = "0.1 s"\ndistance_after = "20 um"',
            70e-6,
        ),
        (
            'kind = "triangle"\nspeed = "5 mm/s"\namplitude = "3 um"\ndistance = "2 um"\ncycles = 3',
            12e-6,
        ),
    ],
    ids=["constant", "dwell", "triangle"],
)
def test_exact_non_periodic_slide_counts_as_one_wear_cycle(slide, path):
    """A slide that does not repeat counts as one wear cycle of its whole path."""
    for contact in (TILTED, TILTED + SHEAR):
        volume = pf.run(contact + COULOMB + f"[slide]\n{slide}\n" + WEAR).measures["worn_volume"]
        assert volume.value == pytest.approx(
            KAPPA * LOAD * path * CYCLES, rel=1e-12 if contact == TILTED else 0.06
        )


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "text",
    [
        TILTED + COULOMB + SINE + WEAR + "jumps = 3\n",
        SOFT_RIG + WEAR + "jumps = 2\n" + LARGE_TOLERANCE,
        TILTED + COULOMB + SINE + WEAR,
        SOFT_RIG + WEAR + LARGE_TOLERANCE,
        WORN_THROUGH_SCENE + "jumps = 12\n",
    ],
    ids=["bench_jumps", "rig_jumps", "bench", "rig", "worn_through"],
)
def test_exact_resumed_wear_run_writes_identical_files(tmp_path, monkeypatch, text):
    """A run that is resumed from its first and last saved state writes the same bytes as
    the uninterrupted run."""
    scene = tmp_path / "worn.toml"
    states = []
    scene.write_text(text)

    save = evolve.save_wear_state

    def save_and_record(path, *arguments):
        save(path, *arguments)
        states.append(path.read_bytes())

    with monkeypatch.context() as patched:
        patched.setattr(evolve, "save_wear_state", save_and_record)
        run_successfully("run", scene, "-o", tmp_path / "whole", "-q", "--no-page")
    assert len(states) >= 2
    for state in (states[0], states[-1]):
        (tmp_path / "out.partial").mkdir()
        (tmp_path / "out.partial/wear.npz").write_bytes(state)
        resumed = run_successfully(
            "run", scene, "-o", tmp_path / "out", "--resume", "-q", "--no-page"
        )
        assert "held the state" not in resumed.err
        for name in ("result.nc", "fields.vtkhdf", "scene.resolved.toml"):
            assert (tmp_path / "out" / name).read_bytes() == (
                tmp_path / "whole" / name
            ).read_bytes(), name
        full_summary, resumed_summary = (
            read_json(tmp_path / name / "summary.json") for name in ("whole", "out")
        )
        times = dict.fromkeys(("seconds", "effects", "accuracy_seconds"), 0)
        assert full_summary | times == resumed_summary | times


def test_exact_worn_through_coating_ends_run():
    """A run ends when the coating of the piece that wears more is worn through: the volume is that of the cycles so far."""
    result = pf.run(WORN_THROUGH_SCENE + "upper_share = 0.2\njumps = 12\n")
    cycle, volume, depth = (
        result.measures[name].value
        for name in ("worn_through_cycle", "worn_volume", "worn_depth_max")
    )
    assert result.outcome == "worn_through" and 0 < cycle < 1e9
    assert depth * 0.8 == pytest.approx(6 * 25.4e-6, rel=1e-6)
    assert volume == pytest.approx(1e-13 * LOAD * 40e-6 * cycle, rel=1e-12)
    assert any("lower piece, 152.4 um, is worn through" in text for text in result.notes)
    # The mean depth is the volume over the area; the tilt adds to the largest depth.
    assert volume / 12.7e-3**2 < depth < volume / 12.7e-3**2 + 0.1e-3 * 12.7e-3
    error = result.measures["worn_through_cycle"].error
    for offset in (-error, error):
        text = WORN_THROUGH_SCENE.replace("1e9", repr(cycle + offset))
        outcome = pf.run(text + "upper_share = 0.2\njumps = 12\n").outcome
        assert (outcome == "worn_through") == (offset > 0)


def test_refuses_to_resume_run_of_other_scene(tmp_path, monkeypatch):
    """An interrupted wear run is resumed only by the same scene."""
    scene = tmp_path / "worn.toml"
    save = evolve.save_wear_state
    scene.write_text(TILTED + COULOMB + SINE + WEAR + "jumps = 2\n")

    def save_and_interrupt(*arguments):
        save(*arguments)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(evolve, "save_wear_state", save_and_interrupt)
        answer = run_cli("run", scene, "-o", tmp_path / "out", "--no-page")
    assert answer.code == 130 and "--resume" in answer.err
    assert [path.name for path in (tmp_path / "out.partial").iterdir()] == ["wear.npz"]
    other = run_cli(
        "run", scene, "-o", tmp_path / "out", "--resume", "--set", "wear.coefficient=2e-14 m^2/N"
    )
    assert other.code == 2 and "another scene" in other.err
    run_successfully("run", scene, "-o", tmp_path / "out", "--resume", "--no-page")
    assert not (tmp_path / "out/wear.npz").exists() and not (tmp_path / "out.partial").exists()


def test_exact_wear_at_step_agrees_with_independent_program():
    """The references are those of an independent finite-element program that integrates Archard's law
    (`tests/support/wear_scenes.py` of version 1.10)."""
    measures = pf.run(FOUND / "worn_522015.toml").measures
    for name, reference, uncertainty in (
        ("approach", 1.1330e-6, 3.3e-10),
        ("normal_stiffness", 2.90147e9, 2e5),
        ("tangential_stiffness", 4.60476e8, 1e4),
        ("rotational_stiffness", 47219.2, 1.2),
    ):
        measure = measures[name]
        assert abs(measure.value - reference) <= measure.error + uncertainty, name
        assert measure.error < 1e-3 * measure.value, name


@pytest.mark.parametrize("state", ["wear.npz", ""])
def test_exact_new_run_reports_discarded_state_once(tmp_path, state):
    """A new run reports once that it discards the saved state of an interrupted run."""
    scene, partial = tmp_path / "plain.toml", tmp_path / "out.partial"
    scene.write_text(POINT + COULOMB + SINE)
    partial.mkdir()
    if state:
        (partial / state).write_bytes(b"kept")
    answer = run_successfully("run", scene, "-o", tmp_path / "out", "--no-page")
    message = "out.partial held the state of an interrupted run, which is now discarded"
    assert answer.err.count(message) == bool(state)
    assert not partial.exists() and not (tmp_path / "out/wear.npz").exists()


def test_refuses_to_resume_wear_without_valid_state(tmp_path):
    """Resuming is refused without a saved state, with a damaged one, and for a scene without wear."""
    scene, partial = tmp_path / "worn.toml", tmp_path / "out.partial"
    scene.write_text(TILTED + COULOMB + SINE + WEAR)
    answer = run_cli("run", scene, "-o", tmp_path / "out", "--resume")
    assert answer.code == 2 and "no interrupted run" in answer.err
    partial.mkdir(exist_ok=True)
    archive = io.BytesIO()
    np.savez(archive, key=np.zeros(1000))
    for damaged in (archive.getvalue()[:-200], b"", b"PK nothing"):
        (partial / "wear.npz").write_bytes(damaged)
        answer = run_cli("run", scene, "-o", tmp_path / "out", "--resume")
        assert answer.code == 2 and "cannot be read" in answer.err, answer.err
    scene.write_text(TILTED + COULOMB + SINE)
    assert run_cli("run", scene, "-o", tmp_path / "out", "--resume").code == 2


def test_always_run_says_that_worn_depth_of_split_trace_is_a_mean(tmp_path, monkeypatch):
    """A run of a trace whose short waves are a layer says that its worn depth is a mean, and the layer does not wear."""
    monkeypatch.chdir(tmp_path)
    rows = (f"{10 * k},{np.sin(k):.3f}" for k in range(400))
    Path("trace.csv").write_text("x [um],z [um]\n" + "\n".join(rows) + "\n")
    Path("scene.toml").write_text(
        '[contact]\nlength = "4 mm"\nwidth = "4 mm"\nheight = "4 mm"\nload = "100 N"\nsubstrate = "steel"\n'
        'element_size = "0.2 mm"\n[contact.profile]\nfile = "trace.csv"\nheights = "surface"\n[contact.asperities]\n'
        'law = "exponential"\nnormal_stiffness = "1e13 Pa/m"\ndecay_length = "0.2 um"\ncutoff = "0.8 mm"\n'
        + COULOMB
        + SINE
        + WEAR
        + "[accuracy]\ntolerance = 0.2\n"
    )
    result = run_successfully("run", "scene.toml", "-o", "out")
    output = result.out + result.err
    assert "at the deepest place of the mean over the short waves" in output
    assert "worn_depth_max is a mean over the short waves" in output
    assert "the layer itself does not wear" in output


def run_worn_rig(contact: str, changes: list[str]):
    """Return measures of a damped Coulomb rig with wear, which is steady after 100 cycles."""
    drive = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 100\n'
    return run_scene(contact + COULOMB + MODE + drive + WEAR, "; ".join(changes)).measures


@pytest.mark.parametrize("frequency", ["286 Hz", "71.5 Hz", "214.5 Hz"])
def test_exact_volume_under_oscillating_load_is_friction_work(frequency):
    """Under Coulomb's law the worn volume is coefficient/mu times the friction work, whatever the load does."""
    changes = [
        "structure.mode.axial.damping=0.02",
        "normal.amplitude=60 N",
        f"normal.frequency={frequency}",
    ]
    found = run_worn_rig(POINT, changes)
    volume, area = found["worn_volume"], found["loop_area"]
    expected = KAPPA * CYCLES * area.value / 0.3
    assert abs(volume.value - expected) <= volume.error + expected * area.error / area.value
    assert volume.error < 1e-3 * volume.value


def test_always_method_harmonic_gives_the_wear_of_the_motion_in_time():
    """Wear of the periodic motion that is found directly is that of the motion after its transient."""
    changes = ["structure.mode.axial.damping=0.02", "accuracy.tolerance=1e-2"]
    in_time = run_worn_rig(TILTED, changes)
    periodic = run_worn_rig(TILTED, [*changes, "accuracy.method=harmonic"])
    for name in ("worn_volume", "worn_depth_max"):
        first, second = in_time[name], periodic[name]
        assert abs(first.value - second.value) <= 1e-3 * first.value
