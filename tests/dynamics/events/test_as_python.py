"""The loop of events as Python: the same motion as compiled, until its work would be long."""

import numpy as np
import pytest
from event_reference import random_basis

from patchfem import compiled
from patchfem.compiled.no_jit import plain
from patchfem.core import BaseSine
from patchfem.dynamics.events import cost, histories
from patchfem.dynamics.events.elements import coulomb, elements_of
from patchfem.structure import drives

NAMES = "march", "dense", "read"
SINE = BaseSine(1.0, 1.2)
SWEEP = drives.Sweep(0.1, 0.4, 40.0, 1.0)


def springs(rng, count):
    return elements_of(rng.uniform(0.2, 1.0, count), rng.uniform(0.05, 1.0, count))


@pytest.mark.share(0, 1, 2, 3, 5, 6)
@pytest.mark.parametrize(
    "seed, n, faces, kind, drive",
    [
        (1, 1, 1, "rigid", SINE),
        (2, 1, 1, "springs", SINE),
        (3, 3, 2, "rigid", SINE),
        (4, 2, 2, "springs", SINE),
        (5, 5, 5, "rigid", SINE),
        (6, 2, 1, "rigid", SWEEP),
        (7, 1, 1, "none", SINE),
    ],
)
def test_exact_the_same_motion_as_compiled(monkeypatch, seed, n, faces, kind, drive):
    """To 1e-11 of its size: the compiler may add in another order, and a motion that rubs doubles such differences."""
    rng = np.random.default_rng(seed)
    modes, found = random_basis(rng, n, faces), []
    groups = [
        coulomb(0.0)
        if kind == "none"
        else springs(rng, 5)
        if kind == "springs"
        else coulomb(*sorted(rng.uniform(0.2, 0.6, 2), reverse=True))
        for _ in range(faces)
    ]
    fast = histories.warm_up()
    for kernels in fast, [plain(f"patchfem.dynamics.events.{name}_kernels") for name in NAMES]:
        monkeypatch.setattr(histories, "warm_up", lambda kernels=kernels: kernels)
        with np.errstate(over="ignore"):  # as compiled code has it
            found.append(
                histories._Run(modes, drive, groups, 12.0, 5, np.inf, None, None).go(0, None)
            )
    one, other = found
    assert one.events == other.events > 24 and one.log.count == other.log.count
    np.testing.assert_array_equal(one.log.what, other.log.what)
    for name in ("time", "modal", "modal_rate", "force", "slip"):
        a, b = (getattr(run.response, name) for run in found)
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-11 * max(1.0, np.abs(a).max()))
    for a, b in ((one.reading.run, other.reading.run), (one.reading.faces, other.reading.faces)):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-10)


def test_exact_a_function_is_compiled_from_where_its_work_is_long(tmp_path, monkeypatch):
    calls = []
    monkeypatch.setattr(compiled, "_prepared", lambda say=None: tmp_path)
    monkeypatch.setattr(compiled, "PATIENCE", 1.0)
    monkeypatch.setattr(compiled, "PLAIN", False)
    home = compiled.Kernels(
        "patchfem.dynamics.events.drive_kernels", histories.warm_up()[0]._text, None
    )
    entry = compiled.Entry(home, "since", "dynamics.events.drive_kernels.since-")
    monkeypatch.setattr(entry, "function", lambda: lambda *given: calls.append(given) or 7.0)
    segment = np.zeros(12)
    assert entry(segment, 2.0, 0.25, 1.5) == 7.0 and len(calls) == 1  # nobody said that it is short
    entry.codes.clear()
    entry.expect(0.4)
    assert entry(segment, 2.0, 0.25, 1.5) == 3.25 and len(calls) == 1
    entry.expect(0.5)
    assert (
        entry.call_with_bound_args(entry.held(0.25, 1.5), segment, 2.0) == 3.25 and len(calls) == 1
    )
    entry.expect(0.2)
    assert entry(segment, 2.0, 0.25, 1.5) == 7.0 and len(calls) == 2
    compiled.UNKEPT.clear()


def test_always_the_cost_as_python_rises_with_what_there_is_to_do():
    rng = np.random.default_rng(4)
    small, large = random_basis(rng, 1, 1), random_basis(rng, 6, 3)
    assert 0 < cost.python_seconds(small, SINE, 0.0, 0) < cost.python_seconds(small, SINE, 1e3, 5)
    assert cost.python_seconds(small, SINE, 0.0, 0) < cost.python_seconds(large, SINE, 0.0, 0)
