"""Drives: their signals, the march under each of them against closed forms and DOP853, scenes that name them."""

import numpy as np
import pytest
from modal_bases import basis_of
from scene_texts import MODE, PLASTIC, POINT
from scipy.integrate import quad

from patchfem import SceneError, plan, run
from patchfem.core import InitialState, Outcome, PatchfemError, SineDrive
from patchfem.dynamics import coulomb_model, jenkins_model
from patchfem.dynamics.march.march import march
from patchfem.scene import loads
from patchfem.structure import make_release
from patchfem.structure.drives import RecordedDrive, SweepDrive, make_levels, make_step

W = 2 * np.pi * 143


def one(omega=W, zeta=0.003, base=1.0):
    return basis_of(omega, zeta, [1.0], [base], mass=0.9)


# ---- signals


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize("low, high", [(50.0, 200.0), (200.0, 50.0)])
def test_exact_the_phase_of_a_sweep_is_the_integral_of_its_frequency(low, high, logarithmic):
    sweep = SweepDrive(low, high, 2.0, 3.0, None, logarithmic)
    for t in (0.3, 1.7, 2.0, 2.4):
        turns = (
            quad(lambda s: float(sweep.frequency(s)), 0, min(t, 2.0), epsabs=1e-12)[0]
            + max(t - 2.0, 0) * high
        )
        assert sweep.phase(t) == pytest.approx(2 * np.pi * turns, rel=1e-12)
    assert sweep.frequency(np.array([0.0, 2.0, 9.0])) == pytest.approx([low, high, high])
    middle = np.sqrt(low * high) if logarithmic else (low + high) / 2
    assert sweep.frequency(1.0) == pytest.approx(middle)
    other = SweepDrive(low, high, 2.0, 0.0, 1e-3, logarithmic)
    assert other.values(1.0) == pytest.approx(
        1e-3 * (2 * np.pi * middle) ** 2 * np.sin(other.phase(1.0))
    )


def test_exact_levels_go_on_in_phase():
    drive = make_levels([2.0, 3.0], W, 2.5)
    sine = SineDrive(1.0, W)
    t = np.linspace(0, 5 * sine.period, 101)[:-1]
    size = np.where(t < 2.5 * sine.period - 1e-12, 2.0, 3.0)
    assert drive.values(t) == pytest.approx(size * np.sin(W * t), abs=1e-12)


def test_refuses_a_signal_without_a_rising_time():
    for time in ([0.0], [0.0, 0.0], [1.0, 2.0]):
        with pytest.raises(PatchfemError, match=r"drive\.file"):
            RecordedDrive(np.array(time), np.zeros(len(time)), 1.0)


# ---- the march


def free(modes, drive, cycles, steps=200, start=None):
    return march(modes, drive, coulomb_model(0.0, 0.0), cycles, steps, window=1000, start=start)


def test_exact_a_step_overshoots_and_settles():
    """-a/w^2 (1 - exp(-z w t)(cos + z/sqrt(1 - z^2) sin)); the accelerometer reads 0 - a + a at first, then w^2 z."""
    drive = make_step(9.0, 2 * np.pi / W)
    zeta = 0.05
    r = free(one(zeta=zeta), drive, 20, 40).response
    own = W * np.sqrt(1 - zeta**2)
    shape = 1 - np.exp(-zeta * W * r.time) * (
        np.cos(own * r.time) + zeta * W / own * np.sin(own * r.time)
    )
    assert r.slide == pytest.approx(-9.0 / W**2 * shape, rel=1e-10, abs=1e-17)
    assert r.acceleration == pytest.approx(-2 * zeta * W * r.slide_rate - W**2 * r.slide, abs=1e-9)
    assert r.base_acceleration == pytest.approx(9.0)


def test_exact_a_release_decays_and_its_energy_counts_as_work():
    """Free viscous decay in closed form; with friction the released energy is what is lost, to round-off."""
    got = free(
        one(), make_release(2 * np.pi / W), 30, 50, InitialState(np.array([1e-3]), np.array([0.2]))
    )
    r = got.response
    own = W * np.sqrt(1 - 0.003**2)
    d = 0.003 * W
    truth = np.exp(-d * r.time) * (
        1e-3 * np.cos(own * r.time) + (0.2 + d * 1e-3) / own * np.sin(own * r.time)
    )
    assert r.slide == pytest.approx(truth, abs=1e-13)
    got = march(
        one(),
        make_release(2 * np.pi / W),
        jenkins_model([39.0 / 1e-6], [1e-6]),
        60,
        100,
        start=InitialState(np.array([3e-4]), np.zeros(1)),
    )
    book = got.ledger
    assert book["work_in"] == pytest.approx(0.45 * (W * 3e-4) ** 2, rel=1e-12)
    assert book["friction"] + book["viscous"] + book["stored"] == pytest.approx(
        book["work_in"], rel=1e-11
    )


# ---- scenes

RIG = POINT + PLASTIC + MODE + "[accuracy]\ntolerance = 1e-2\n"


def measured(drive, head=RIG):
    result = run(plan(loads(f"{head}[drive]\n{drive}")))
    assert result.outcome is not Outcome.NOT_CONVERGED
    return result, {name: m.value for name, m in result.measures.items()}


def test_exact_a_force_scene_is_the_base_scene_seen_from_outside():
    _, force = measured('kind = "force"\nfrequency = "143 Hz"\nforce = "39 N"\ncycles = 30')
    _, base = measured(
        f'kind = "base"\nfrequency = "143 Hz"\nacceleration = "{39 / 0.884!r} m/s^2"\ncycles = 30'
    )
    for name in ("relative_displacement_amplitude", "loop_area", "friction_work"):
        assert force[name] == pytest.approx(base[name], rel=1e-9)
    assert force["absolute_acceleration_peak"] != pytest.approx(
        base["absolute_acceleration_peak"], rel=1e-2
    )


def test_exact_a_recorded_scene_follows_its_file(tmp_path):
    t = np.arange(0, 0.1, 2e-5)
    table = tmp_path / "shake.csv"
    table.write_text(
        "time [ms],acceleration [g]\n"
        + "\n".join(f"{1e3 * s!r},{5 * float(np.sin(W * s))!r}" for s in t.tolist()),
        "utf-8",
    )
    scene = loads(
        RIG + '[drive]\nkind = "base"\nwaveform = "file"\nfile = "shake.csv"\n',
        tmp_path / "scene.toml",
    )
    got = {name: m.value for name, m in run(plan(scene)).measures.items()}
    _, want = measured(
        f'kind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\nduration = "{float(t[-1])!r} s"'
    )
    assert got["relative_displacement_amplitude"] == pytest.approx(
        want["relative_displacement_amplitude"], rel=2e-3
    )


@pytest.mark.parametrize(
    "drive, key",
    [
        (
            'kind = "base"\nwaveform = "sweep"\nfrom = "1 Hz"\nto = "9 Hz"\nacceleration = "1 g"',
            "drive.rate",
        ),
        (
            'kind = "base"\nwaveform = "sweep"\nfrom = "9 Hz"\nto = "9 Hz"\nrate = "1 Hz/s"\nacceleration = "1 g"',
            "drive.to",
        ),
        (
            'kind = "base"\nwaveform = "sweep"\nfrom = "1 Hz"\nto = "9 Hz"\nrate = "1 Hz/s"\nlog_rate = "1 oct/min"\n'
            'acceleration = "1 g"',
            "drive.log_rate",
        ),
        (
            'kind = "force"\nwaveform = "levels"\nlevels = ["1 g"]\nfrequency = "9 Hz"\ncycles = 3',
            "drive.levels",
        ),
        ('kind = "base"\nwaveform = "levels"\nfrequency = "9 Hz"\ncycles = 3', "drive.levels"),
        ('kind = "base"\nwaveform = "step"\ncycles = 3', "drive.acceleration"),
        ('kind = "force"\nwaveform = "step"\ncycles = 3', "drive.force"),
        ('kind = "base"\nwaveform = "file"', "drive.file"),
    ],
)
def test_refuses_a_drive_that_is_not_whole(drive, key):
    with pytest.raises(SceneError, match=key.replace(".", r"\.")):
        loads(f"{RIG}[drive]\n{drive}")


@pytest.mark.parametrize(
    "text, word",
    [
        ("time [s],acceleration [g]\n0,0\n1,0\n", "0 in every row"),
        ("time [s],force [N]\n0,0\n1,1\n", "acceleration"),
        ("time [s],acceleration [g]\n0,1\n0,2\n", "strictly rise"),
        ("time [s],acceleration\n0,1\n1,2\n", "acceleration"),
    ],
)
def test_refuses_a_broken_signal(tmp_path, text, word):
    (tmp_path / "shake.csv").write_text(text, "utf-8")
    scene = loads(
        RIG + '[drive]\nkind = "base"\nwaveform = "file"\nfile = "shake.csv"\n',
        tmp_path / "scene.toml",
    )
    with pytest.raises(PatchfemError, match=word):
        run(plan(scene))
