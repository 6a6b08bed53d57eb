"""Small cases for the tests of `event_driven`: one mass of 1 kg on a spring of 1 N/m, and benches with straight legs."""

from types import SimpleNamespace

import numpy as np

from patchfem.core import ModalBasis
from patchfem.event_driven import cases, drives
from patchfem.event_driven.records import LawNumbers


def make_modes(omega=1.0, zeta=0.0, **rows) -> ModalBasis:
    """Return modes of unit mass; slide, base and output are 1 unless given."""
    omega = np.atleast_1d(np.asarray(omega, float))
    ones = np.ones(omega.size)
    parts = {name: np.asarray(rows.pop(name, ones), float) for name in ("slide", "base", "output")}
    zeta = np.broadcast_to(np.asarray(zeta, float), omega.shape)
    return ModalBasis(tuple(map(str, range(omega.size))), omega, zeta, **parts, mass=1.0, **rows)


def coulomb(static: float = 1.0, kinetic: float | None = None) -> LawNumbers:
    """Return Coulomb's law."""
    return LawNumbers("coulomb", (static, static if kinetic is None else kinetic))


def make_oscillator(
    law,
    *,
    load=0.8,
    acceleration=1.0,
    zeta=0.003,
    omega=1.0,
    cycles=200.0,
    z=0.0,
    rtol=1e-10,
    samples=(),
    **options,
) -> cases.Case:
    """Return a mass that the base drives at `omega` with an interface, or a release from z."""
    modes = make_modes(zeta=zeta)
    signal = drives.make_tones(
        [(acceleration, omega, 0.0)] if acceleration else [], 2 * np.pi / omega
    )
    if not isinstance(load, cases.Load):
        load = cases.Load(load)
    interface = cases.Interface(law, load, np.ones(1))
    options = cases.Options(moves_base=True, rtol=rtol, **options)
    rig = cases.make_rig(modes, signal, [interface], (1.0, 1.0), options)
    start = cases.make_start(rig, [interface], SimpleNamespace(z=[z], v=[0.0]))
    schedule = cases.make_schedule(cycles, signal.period, 10)
    return cases.Case(rig, start, *schedule, np.asarray(samples, float), 1)


def make_bench(law, time, slide, *, load=1.0, samples=(), rtol=1e-11) -> cases.Case:
    """Return a bench whose slide is straight between corners; the last leg is the window."""
    signal = drives.make_record(time, slide, time[-1])
    signal.pieces[-1, 1] = slide[-1]
    if not isinstance(load, cases.Load):
        load = cases.Load(load)
    interface = cases.Interface(law, load, np.ones(1))
    sizes = np.abs(slide).max(), np.abs(np.diff(slide) / np.diff(time)).max()
    rig = cases.make_rig(None, signal, [interface], sizes, cases.Options(rtol=rtol))
    ends = np.array([time[-1]], float)
    return cases.Case(
        rig, cases.make_start(rig, [interface]), ends, np.zeros(1), np.asarray(samples, float), 1
    )
