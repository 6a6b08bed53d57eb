"""The comparison methods by themselves: kernels, order, compiled loops against plain ones, ledgers, refusals."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from comparison_cases import (
    COUPLED,
    FREE_FREE,
    PLAIN,
    THREE,
    UNIT,
    basis,
    duhamel_twin,
    elastic_plastic,
    euler_twin,
    free_motion,
    newmark_twin,
    numbers,
    sine,
    tanh,
)
from hypothesis import given
from hypothesis import strategies as st
from report_methods import duhamel, euler, newmark
from report_methods.point_laws import Coulomb, added_static, loops, rows
from report_methods.steps import first_forces

from patchfem.core import InitialState, PatchfemError, SineDrive, frozen_array
from patchfem.structure.drives import Recorded, release

DRIVE = SineDrive(1.3, 0.9)
# each of the three laws in each, so that all are one loop to compile
MIXED = [
    (Coulomb(0.5, 0.4, 0.02), tanh(0.3, 0.1), elastic_plastic(0.1, 0.2)),
    (elastic_plastic(0.4, 0.2), Coulomb(0.3, 0.3), tanh(0.1, 0.1)),
    (elastic_plastic(0.2, 0.3, True), tanh(0.3, 0.05), Coulomb(0.1, 0.08, 0.02)),
]


def forced(w, zeta, f0, f1, h):
    """(z, z') after h from rest under a force straight from f0 to f1, in closed form."""
    r = (f1 - f0) / h
    if w == 0:
        return f0 * h**2 / 2 + r * h**3 / 6, f0 * h + r * h**2 / 2
    z = lambda t: (f0 + r * t) / w**2 - 2 * zeta * r / w**3  # noqa: E731
    a, b = np.roots([1.0, 2 * zeta * w, w * w]) if zeta != 1 else (-w, -w)
    p, q = -z(0.0), -r / w**2
    c = (q - b * p) / (a - b) if a != b else 0.0
    d = (a * p - q) / (a - b) if a != b else 0.0
    free = c * np.exp(a * h) + d * np.exp(b * h)
    rate = a * c * np.exp(a * h) + b * d * np.exp(b * h)
    return z(h) + np.real(free), r / w**2 + np.real(rate)


@given(
    st.sampled_from([0.0, 0.3, 1.0, 7.0]),
    st.sampled_from([0.0, 0.01, 0.5, 3.0]),
    st.floats(-2, 2),
    st.floats(-2, 2),
    st.floats(0.05, 2.0),
)
def test_always_duhamel_kernels_are_exact_for_straight_forces(w, zeta, f0, f1, h):
    one = duhamel.kernels(basis([w], [zeta], [[1.0]], [1.0]), h)[0]
    truth = forced(w, zeta if w else 0.0, f0, f1, h)
    assert one[:, 2:] @ [f0, f1] == pytest.approx(truth, abs=1e-12 / min(w or 1.0, 1.0) ** 3)


def test_exact_duhamel_kernels_to_the_last_digits():
    modes = basis([0.0, 1.0, np.sqrt(2.0), 5.0], [0.0, 0.0, 0.02, 2.0], [[1.0] * 4], [1.0] * 4)
    for one, w, zeta in zip(duhamel.kernels(modes, 0.7), modes.omega, modes.zeta):
        assert one[:, 2:] @ [0.3, -0.8] == pytest.approx(forced(w, zeta, 0.3, -0.8, 0.7), abs=1e-13)


def test_exact_duhamel_under_a_piecewise_straight_drive():
    """A signal straight between its points is integrated exactly by steps that end at them, however long."""
    modes = basis([0.0, 1.3, 3.1], [0.0, 0.02, 2.0], np.zeros((0, 3)), [0.4, -0.8, 0.3])
    drive = Recorded(np.arange(9.0), np.array([0.0, 1, -1, 2, 0, 0, 3, -2, 1]), 8.0)
    coarse, fine = (duhamel.run(modes, drive, (), 8.0, steps) for steps in (8, 800))
    assert coarse.z[-1] == pytest.approx(fine.z[-1], abs=1e-12)
    assert coarse.v[-1] == pytest.approx(fine.v[-1], abs=1e-12)


@pytest.mark.parametrize("method, order", [(duhamel, 2), (newmark, 2), (euler, 1)])
@pytest.mark.parametrize("damped", [None, COUPLED.damping])
def test_order_without_friction(method, order, damped):
    modes = basis(COUPLED.omega, COUPLED.zeta, np.zeros((0, 3)), COUPLED.base, damped)
    errors = []
    for steps in (3200, 6400) if method is euler else (400, 800):
        found = method.run(modes, DRIVE, (), 1.5 * DRIVE.period, steps)
        z, v = free_motion(modes, DRIVE, found.time[-1:])
        errors.append(np.abs(np.concatenate([found.z[-1] - z[0], found.v[-1] - v[0]])).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)
    assert errors[0] < {1: 0.1, 2: 1e-3}[order]


@pytest.mark.share(0)
@pytest.mark.parametrize("laws", MIXED)
def test_exact_compiled_duhamel_is_the_plain_one(laws):
    found = duhamel.run(THREE, DRIVE, laws, DRIVE.period, 120, "force", 1e-5, 0.4, most=25)
    begin = first_forces(THREE, rows(laws, 3), loops(), found.drive[0], found.z[0], found.v[0])
    z, v, force = duhamel_twin(
        THREE, found.drive, numbers(laws), found.time[1], begin, 1e-5, 0.4, 25
    )
    assert np.abs(found.z).max() > 0.1
    for mine, plain in ((found.z, z), (found.v, v), (found.force, force)):
        assert mine == pytest.approx(plain, abs=1e-11)


@pytest.mark.parametrize("laws", MIXED)
def test_exact_compiled_euler_is_the_plain_one(laws):
    found = euler.run(THREE, DRIVE, laws, DRIVE.period, 400)
    z, v, force = euler_twin(THREE, found.drive, numbers(laws), found.time[1])
    assert np.abs(found.z).max() > 0.1
    for mine, plain in ((found.z, z), (found.v, v), (found.force, force)):
        assert mine == pytest.approx(plain, abs=1e-12)


@pytest.mark.parametrize(
    "laws", [*MIXED, (Coulomb(0.6, 0.5, 0.03), Coulomb(0.4, 0.4, 0.02), Coulomb(0.1, 0.1))]
)
def test_exact_compiled_newmark_is_the_plain_one(laws):
    found = newmark.run(THREE, DRIVE, laws, 1.5 * DRIVE.period, 100)
    z, v, force = newmark_twin(THREE, found.drive, numbers(laws), found.time[1], found.time.size)
    assert np.abs(found.z).max() > 0.1
    for mine, plain in ((found.z, z), (found.v, v), (found.force, force)):
        assert mine == pytest.approx(plain, abs=1e-9)


@pytest.mark.parametrize("method", [duhamel, newmark, euler])
def test_order_of_the_energy_error(method):
    """The ledger's error is the method's own: it falls with its order, and Euler makes energy."""
    laws = (elastic_plastic(0.4, 0.5), tanh(0.3, 0.5))
    books = [
        method.run(COUPLED, DRIVE, laws, 2 * DRIVE.period, steps).ledger
        for steps in (500, 1000, 2000)
    ]
    first, second = (a["error"] / b["error"] for a, b in pairwise(books))
    assert books[-1]["friction"] > 2
    if method is euler:  # ratios 2 + c h: what is beyond 2 halves with the step
        assert second == pytest.approx(2, rel=0.03) and second - 2 == pytest.approx(
            (first - 2) / 2, rel=0.2
        )
        assert -0.11 < books[-1]["error"] < 0
    else:
        assert [first, second] == pytest.approx([4, 4], rel=2e-3) and abs(books[-1]["error"]) < 3e-6


def test_exact_ledger_of_a_free_slide():
    """A constant force on a sliding free mass: work, loss and speed of the textbook."""
    modes = basis([0.0], [0.0], [[1.0]], [-1.0], mass=2.0)
    drive = Recorded(np.array([0.0, 10.0]), np.array([3.0, 3.0]), 10.0, False)
    found = newmark.run(
        modes,
        drive,
        (Coulomb(1.0, 1.0),),
        10.0,
        50,
        start=InitialState(np.zeros(1), np.array([0.1])),
    )
    assert found.v[-1, 0] == pytest.approx(0.1 + 2.5 * 10)
    assert found.z[-1, 0] == pytest.approx(1.0 + 125.0)
    assert found.ledger["work_in"] == pytest.approx(6 * 126.0)
    assert found.ledger["friction"] == pytest.approx(126.0)
    assert abs(found.ledger["error"]) <= 1e-9
    assert found.accelerations(modes)[-1] == pytest.approx([2.5])


@pytest.mark.parametrize("method, values, word", [
    (duhamel, {"convergence": "energy"}, "accuracy.convergence"),
    (duhamel, {"tolerance": 0.0}, "convergence_tolerance"),
    (duhamel, {"relax": 1.5}, "relax"),
    (newmark, {"stick_speed": -1.0}, "accuracy.stick_speed"),
    (newmark, {"stick_speed": np.nan}, "accuracy.stick_speed"),
    (euler, {"steps_per_cycle": 2}, "steps_per_cycle"),
    (euler, {"duration": 1e12}, "drive.cycles"),
    (euler, {"start": InitialState(np.zeros(2), np.zeros(2))}, "1 displacements"),
    (euler, {"duration": np.nan}, "drive.cycles"),
    (duhamel, {"tolerance": np.inf}, "convergence_tolerance"),
    (newmark, {"start": InitialState(np.array([np.nan]), np.zeros(1))}, "finite"),
    (duhamel, {"modes": basis([1.0], [0.0], [[0.0]], [1.0])}, "no mode moves interface 1"),
    (euler, {"laws": ()}, "0 friction laws for 1"),
    (newmark, {"laws": (Coulomb(1.0, 2.0),)}, "friction.kinetic"),
    (newmark, {"laws": (tanh(1.0, np.inf),)}, "above zero"),
    (newmark, {"laws": (elastic_plastic(-1.0, 1.0),)}, "above zero"),
])  # fmt: skip
def test_refuses_what_cannot_be(method, values, word):
    call = {"modes": PLAIN, "drive": UNIT, "laws": (Coulomb(1.0, 1.0),), "duration": 10.0} | values
    with pytest.raises(PatchfemError, match=word):
        method.run(**call)


def said(found) -> str:
    return " ".join(found.warnings)


def test_exact_warnings_of_each_method():
    slow, drive = (Coulomb(3.0, 3.0),), sine(1.14, 0.05)
    loose = duhamel.run(FREE_FREE, drive, slow, 10.0, 1000, "displacement", 1e-3)
    # 6 m delta/(relax h^2) per mass, over 3
    assert "friction force of up to 1.6 of the friction limit" in said(loose)
    assert "differs from the friction law by up to" in said(
        loose
    ) and "never sticks in this method" in said(loose)
    tight = duhamel.run(FREE_FREE, drive, slow, 10.0, 1000, "displacement", 1e-6, 0.1)
    assert "did not converge within" in said(tight) and tight.failures > 10
    stiff = duhamel.run(
        FREE_FREE, drive, (elastic_plastic(3.0, 0.003),), 10.0, 1000, "velocity", 1e-6
    )
    assert "block on the elastic contact advances by" in said(stiff)
    assert "printed" in said(
        duhamel.run(FREE_FREE, drive, (elastic_plastic(3.0, 0.1, True),), 10.0, 1000)
    )
    caught = newmark.run(PLAIN, UNIT, (Coulomb(0.8, 0.8),), 10.0, 1000, 1e-3)
    assert "up to a force of 1.12 N instead of 0.8 N" in said(
        caught
    ) and "stops the interface at once" in said(caught)
    assert "instead of" not in said(
        newmark.run(PLAIN, UNIT, (Coulomb(0.8, 0.8),), 10.0, 1000, 1e-3, True)
    )
    grown = euler.run(PLAIN, UNIT, (tanh(0.1, 0.01),), 10.0, 30)
    assert "free vibration of this mode grows" in said(grown) and "never sticks" in said(grown)
    assert "changes its sign from step to step" in said(grown)
    assert "by the numerical method" in said(
        euler.run(
            PLAIN,
            release(6.0),
            (tanh(1e-6, 1.0),),
            60.0,
            100,
            InitialState(np.ones(1), np.zeros(1)),
        )
    )
    assert "infinite or undefined" in said(
        euler.run(basis([300.0], [0.0], [[1.0]], [1.0]), UNIT, (tanh(0.1, 1.0),), 3000.0, 300)
    )


@pytest.mark.parametrize("by_force, release_at", [(False, 3.0), (True, 1.0)])
def test_exact_stick_speed_is_static_friction_that_grows(by_force, release_at):
    """A force that rises by 1 N/s against 1 N: with v_th = .01 m/s the step of .01 s holds it up to 3 N."""
    modes = basis([0.0], [0.0], [[1.0]], [-1.0])
    drive = Recorded(np.array([0.0, 4.0]), np.array([0.0, 4.0]), 4.0, False)
    assert added_static(modes, modes.slide, 0.01, 0.01) == pytest.approx(2.0)
    found = newmark.run(modes, drive, (Coulomb(1.0, 1.0),), 4.0, 400, 0.01, by_force)
    assert found.time[np.argmax(found.v[:, 0] > 0)] == pytest.approx(release_at, abs=0.021)


@pytest.mark.parametrize("by_force, order", [(True, 2), (False, 1)])
def test_order_of_the_first_slide(by_force, order):
    """Let go at 11.5 F/k: 1 + 10.5 cos t until t = pi. By speed alone the first step begins without acceleration."""
    start, errors = InitialState(np.array([11.5]), np.zeros(1)), []
    for steps in (200, 400):
        found = newmark.run(
            PLAIN, release(2 * np.pi), (Coulomb(1.0, 1.0),), 3.0, steps, 1e-3, by_force, start
        )
        assert found.force[0, 1] == -1.0
        errors.append(np.abs(found.z[:, 0] - 1 - 10.5 * np.cos(found.time)).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


def test_exact_response_of_a_run():
    """Histories as every engine hands them out: the absolute acceleration balances spring, damper and friction."""
    laws = (Coulomb(0.6, 0.5, 0.03), tanh(0.4, 0.1), elastic_plastic(0.1, 0.2))
    found = newmark.run(THREE, DRIVE, laws, 2 * DRIVE.period, 400)
    out = found.response(THREE)
    k = 300
    own = (
        -(THREE.omega**2) * found.z[k]
        - THREE.damping @ found.v[k]
        - THREE.faces.T @ found.force[:, k] / THREE.mass
        - THREE.base * found.drive[k]
    )
    assert out.acceleration[k] == pytest.approx(own @ THREE.output + found.drive[k], abs=1e-12)
    assert found.response(THREE, False).acceleration[k] == pytest.approx(
        own @ THREE.output, abs=1e-12
    )
    assert out.slide == pytest.approx(THREE.faces[0] @ found.z.T)
    middle = (out.slide[k + 1] - out.slide[k - 1]) / (found.time[k + 1] - found.time[k - 1])
    assert middle == pytest.approx(out.slide_rate[k], abs=2e-3) and np.array_equal(
        out.force, found.force[0]
    )
    assert np.array_equal(out.extra["forces"], found.force) and not found.z.flags.writeable


def test_exact_forces_of_a_start():
    """One interface slides and the other is held: the held one is given no acceleration, up to its limit."""
    pair = (Coulomb(9.0, 9.0, 0.1), tanh(0.3, 0.1))
    laws, compiled, v = rows(pair, 2), loops(), np.array([0.4, 0.7, 0.0])
    z = np.array([0.2, -0.3, 0.1])
    assert COUPLED.faces @ v == pytest.approx([0.0, 0.5])
    force = first_forces(COUPLED, laws, compiled, 0.7, z, v)
    accel = (
        -COUPLED.base * 0.7
        - COUPLED.omega**2 * z
        - COUPLED.damping @ v
        - COUPLED.faces.T @ force / COUPLED.mass
    )
    assert force[1] == pytest.approx(0.3 * np.tanh(5.0)) and COUPLED.faces[
        0
    ] @ accel == pytest.approx(0.0, abs=1e-13)
    laws[0, 1:3] = 0.01
    assert first_forces(COUPLED, laws, compiled, 0.7, z, v)[0] == pytest.approx(
        0.01 * np.sign(force[0])
    )
    assert first_forces(COUPLED, laws, compiled, 0.7, z, -v)[1] == pytest.approx(
        -0.3 * np.tanh(5.0)
    )


@pytest.mark.parametrize("method", [duhamel, newmark, euler])
def test_exact_read_only_arrays_and_any_order_in_memory_give_the_same_motion(method):
    """Arrays of a rig's file and of a rig made by hand differ in both."""
    laws = (Coulomb(0.5, 0.4, 0.02), Coulomb(0.3, 0.3))
    damping = np.array([[0.2, 0.1], [0.1, 0.3]])
    faces = np.array([[1.0, 0.5], [0.3, -0.8]])
    ends = []
    for form in (frozen_array, np.array, np.asfortranarray):
        modes = replace(
            basis([1.0, 2.5], [0.02, 0.05], faces, [1.0, 0.4]),
            damping=form(damping),
            faces=form(faces),
        )
        ends.append(method.run(modes, DRIVE, laws, 20.0, 40).z[-1])
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])
