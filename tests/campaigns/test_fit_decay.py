"""Parameters of a joint from frequency and damping over the amplitude."""

import numpy as np
import pytest
from command_line import cli
from scene_texts import DRIVE, KILOGRAM, POINT, friction_of

import patchfem as pf
from patchfem.campaigns.fit_decay import read_curve
from patchfem.core import PatchfemError

IWAN = POINT + friction_of("iwan").replace("1e7 N/m", "1e6 N/m").replace("chi = -0.5", "chi = -0.35") + KILOGRAM + DRIVE
START = IWAN.replace("chi = -0.35", "chi = -0.6").replace("1e6 N/m", "6e5 N/m")
FREE = {"friction.stiffness": ("3e5 N/m", "3e6 N/m"), "friction.chi": (-0.9, -0.05)}


def written(path, text: str, noise: float = 0.0, seed: int = 0, count: int = 3):
    """The balanced curve of a scene as a decay on disk, with relative noise on frequency (a hundredth) and damping."""
    curve = pf.backbone(text, amplitudes=np.geomspace(1e-6, 2e-5, count), method="balance")
    a, f, z = (curve[f"balance_{name}"].values for name in ("amplitude", "frequency", "damping"))
    rng = np.random.default_rng(seed)
    f, z = f * (1 + noise / 100 * rng.normal(size=f.size)), z * (1 + noise * rng.normal(size=z.size))
    rows = [f"{x!r},{y!r},{0.02 * (noise or 1e-4) * y!r},{w!r},{2 * (noise or 1e-4) * w!r}"
            for x, y, w in zip(a.tolist(), f.tolist(), z.tolist())]
    head = "decay_amplitude [m],decay_frequency [Hz],decay_frequency_error [Hz],decay_damping,decay_damping_error"
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def test_exact_a_made_up_joint_is_found_again(tmp_path):
    """Stiffness and exponent of an Iwan joint from its own curve, and the fitted scene has it."""
    found = pf.fit(START, to=written(tmp_path / "decay.csv", IWAN), free=FREE, out=tmp_path / "out")
    values = {name: one["value"] for name, one in found["values"].items()}
    assert values["friction.stiffness"] == pytest.approx(1e6, rel=1e-5)
    assert values["friction.chi"] == pytest.approx(-0.35, abs=1e-5)
    assert found["outcome"] == "done" and found["rms"]["damping"] < 1e-5
    assert pf.load(tmp_path / "out/scene.fitted.toml").friction.chi == pytest.approx(-0.35, abs=1e-5)


def test_the_verb_reads_a_curve_and_refuses_what_is_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(START)
    written(tmp_path / "decay.csv", IWAN)
    ask = ["fit", "rig.toml", "--to", "decay.csv", "--free", "friction.chi=-0.9..-0.05"]
    assert "--hold" in cli(*ask, "--hold", "frequency=1 Hz").err
    answer = cli(*ask, "--set", "friction.stiffness=1e6 N/m", "-o", "out")
    assert answer.code == 0 and "3 amplitudes of decay.csv by balance" in answer.out and "friction.chi" in answer.out
    both = tmp_path / "backbone.csv"
    both.write_text("method,amplitude [m],frequency [Hz],damping\na,1e-6,100,0.1\nb,2e-6,100,0.1\n")
    with pytest.raises(PatchfemError, match="several methods"):
        read_curve(both)
    both.write_text("amplitude [m],frequency [Hz],damping\n-1e-6,100,0.1\n2e-6,100,0.1\n")
    with pytest.raises(PatchfemError, match="above 0"):
        read_curve(both)
    both.write_text("amplitude [m],frequency [Hz],frequency_error [Hz],damping\n1e-6,100,-1,0.1\n2e-6,100,1,0.1\n")
    with pytest.raises(PatchfemError, match="an error below 0"):
        read_curve(both)
