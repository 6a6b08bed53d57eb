"""Scenes to start from: each is of the kind that it says, runs as it stands and misses no tolerance."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import root

import patchfem as pf
from patchfem.core import Outcome, PatchfemError
from patchfem.scene.scene import load, loads
from patchfem.scene.starting import (
    NEXT_VERBS,
    TEMPLATE_DESCRIPTIONS,
    find_shipped_scene,
    read_template,
)

ENDS = {
    "patch": Outcome.DONE,
    "joint": Outcome.DONE,
    "bench": Outcome.DONE,
    "rig": Outcome.STEADY,
    "linear": Outcome.STEADY,
    "wear": Outcome.DONE,
}
BLADE = (
    np.array([[1e6, -1e6], [-1e6, 6e6]]),
    np.diag([0.15, 0.25]),
    np.array([[2.0, -2.0], [-2.0, 12.0]]),
)
FLATS = 7e7  # N/m


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.slow] * (kind == "wear")) for kind in ENDS]
)
def test_always_it_runs_without_a_warning(kind):
    result = pf.run(loads(read_template(kind)))
    assert result.outcome == ENDS[kind] and not result.warnings


def test_exact_the_linear_scene_is_a_resonance_curve():
    """x = a/(w0² - w² + 2 i zeta w0 w) of the block against the base, off resonance."""
    from math import pi

    measured = pf.run(loads(read_template("linear"))).measures["relative_displacement_amplitude"]
    w0 = 2 * pi * 143
    w = 2 * pi * 140
    assert measured.value == pytest.approx(
        0.5 * 9.80665 / abs(w0**2 - w**2 + 2j * 0.003 * w0 * w), rel=1e-4
    )


def test_always_a_sweep_and_the_scene_of_the_rig_are_read():
    scene = loads(read_template("misalignment"))
    assert [axis.key for axis in scene.sweep] == ["contact.tilt.angle"] and scene.kind == "rig"
    assert load(find_shipped_scene()).measured is not None
    assert set(TEMPLATE_DESCRIPTIONS) == {*ENDS, *NEXT_VERBS}


def test_exact_the_numbers_that_the_damper_tells():
    """Free and held frequency of two masses, the load of two flats of a wedge, the amplitude at the held resonance."""
    text = read_template("damper")
    free, held = (
        np.sqrt(eigh(BLADE[0] + np.diag([0, k]), BLADE[1])[0][0]) / (2 * np.pi)
        for k in (0.0, FLATS)
    )
    flats = 2 * 3e-3 * 0.3 * (10000 * np.pi / 30) ** 2 / (2 * np.sin(np.pi / 3))
    assert f"has {free:.0f} Hz with free platforms and {held:.0f} Hz with ones that stick" in text
    assert round(flats, -1) == 1140 and round(flats / 4) == 285
    for pressed, place in (("1 N", free), ("100 kN", held)):
        found = pf.run(loads(damper()), **{"structure.interface[1].load": pressed}).measures
        assert abs(found["peak_frequency"].value - place) < found["peak_frequency"].error + 0.2


def damper() -> str:
    """The scene of the damper, of one run."""
    text = read_template("damper")
    return text[: text.index("\n[sweep]")] + text[text.index("\n[accuracy]") :]


def peak_of(limit: float, places, count: int = 8, samples: int = 256) -> float:
    """Largest motion of the airfoil [m] at frequencies [Hz] under 20 N, the flats of FLATS [N/m] slipping at a `limit`
    [N]: odd harmonics of the platform, balanced by a root finder, the force played through two periods."""
    stiff, mass, damp = BLADE
    order = np.arange(1, 2 * count, 2)
    wave = np.exp(1j * np.outer(order, 2 * np.pi * np.arange(samples) / samples))
    best = 0.0
    start = None

    def force(slide):
        out = np.zeros(samples)
        now = 0.0
        last = slide[0]
        for _ in range(2):
            for k, place in enumerate(slide.tolist()):
                now = min(max(now + FLATS * (place - last), -limit), limit)
                last = place
                out[k] = now
        return 2 / samples * (wave.conj() @ out)

    for place in places:
        answer = np.array(
            [np.linalg.inv(stiff - w * w * mass + 1j * w * damp) for w in 2 * np.pi * place * order]
        )
        push = np.where(order == 1, 20.0, 0.0)
        scale = 1e-5 if start is None else np.abs(start).max()

        def left(x, answer=answer, push=push, scale=scale):
            slide = (x[:count] + 1j * x[count:]) * scale
            miss = (
                slide
                - answer[:, 1, 0] * push
                + answer[:, 1, 1] * force((slide[:, None] * wave).real.sum(0))
            )
            return np.concatenate([miss.real, miss.imag]) / scale

        first = answer[:, 1, 0] * push if start is None else start
        found = root(left, np.concatenate([first.real, first.imag]) / scale, tol=1e-9)
        assert found.success, place
        start = (found.x[:count] + 1j * found.x[count:]) * scale
        tip = answer[:, 0, 0] * push - answer[:, 0, 1] * force((start[:, None] * wave).real.sum(0))
        best = max(best, np.ptp((tip[:, None] * wave).real.sum(0)) / 2)
    return best


def test_exact_the_best_load_of_the_damper_is_that_of_an_independent_balance():
    """The flats keep their stiffness as their load changes: 0.7 and 1.4 times the best load let the peak grow."""
    pressed = {225.0: 365.5, 316.2: 380.2, 450.0: 395.8}  # load [N] -> about where its peak is [Hz]
    peaks = [peak_of(0.3 * load, np.arange(at - 3, at + 3, 0.5)) for load, at in pressed.items()]
    found = [
        pf.run(loads(damper()), **{"structure.interface[1].load": load}).measures
        for load in pressed
    ]
    ours = [one["relative_displacement_amplitude"].value for one in found]
    assert ours == pytest.approx(peaks, rel=5e-3) and np.argmin(peaks) == np.argmin(ours) == 1


def test_exact_the_numbers_that_the_shrouds_tell():
    """Slides 0.3 sin(pi n/24); shrouds that hold are springs of friction limit over bond length."""
    text = read_template("shroud")
    for n, slide in ((2, "0.0776"), (4, "0.15"), (8, "0.2598")):
        assert (
            f"{0.3 * np.sin(np.pi * n / 24):.4f}".rstrip("0") == slide.ljust(6, "0").rstrip("0")
            and slide in text
        )
    stiff = 0.3 * (2 * np.pi * 250) ** 2 + 0.2598**2 * 0.3 * 300 / 20e-6
    assert f"up to {np.sqrt(stiff / 0.3) / (2 * np.pi):.0f} Hz with held ones" in text


def test_always_the_beam_goes_from_the_bolted_to_the_free_frequency():
    found = pf.backbone(
        loads(read_template("beam")), amplitudes=[1e-6, 3e-3], method="quasi-static"
    )
    f, zeta = (found[f"quasi_static_{name}"].values.ravel() for name in ("frequency", "damping"))
    assert f[0] == pytest.approx(150, rel=3e-3) and zeta[0] == pytest.approx(1e-3, rel=0.01)
    assert 100 < f[1] < 0.8 * f[0] and zeta[1] > 5 * zeta[0]


def test_refuses_a_kind_that_is_not_there():
    with pytest.raises(PatchfemError, match="joitn: unknown kind of scene; did you mean 'joint'"):
        read_template("joitn")
