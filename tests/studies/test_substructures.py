"""Structures of a finite-element program: the other side of the study is right, and reduced ones stay near it."""

import os
import sys

import numpy as np
import pytest
from scipy.sparse.linalg import splu
from study_module import study

from patchfem.core import Missing


@pytest.fixture(scope="module")
def large():
    return study("substructures/large.py")


@pytest.fixture(scope="module")
def readers():
    return study("substructures/readers.py")


@pytest.fixture(scope="module")
def formats():
    return study("substructures/formats.py")


def test_exact_receptances_of_all_unknowns(large):
    """Those by a Krylov space are those of the factored dynamic stiffness, at the first and the last harmonic, to the
    round-off of the solutions that the space is made of: half of it gives the same."""
    make, pairs, pushed, watched, _, coarse = large.STRUCTURES["lap joint"]
    model = make(coarse)
    rows, _ = large.rows_of(model, pairs, pushed, watched)
    whole = large.Whole(model, rows)
    for omega in 2 * np.pi * whole.frequencies[0] * np.array([0.9, 0.9 * large.TOP]):
        own = model.stiffness + 1j * omega * model.damping - omega**2 * model.mass
        wanted = splu(own.tocsc()).solve(whole.loads + 0j)[rows]
        found, rest = whole.at(omega)
        assert np.abs(found - wanted).max() < 1e-8 * np.abs(wanted).max() and rest < 1e-8


def test_exact_loop_of_an_element(large):
    """4 F (A - F/k) for an element of k that slips at F along a sine of A."""
    stiffness, limit, amplitude, count = 2e6, 3.0, 1e-5, 20000
    slide = amplitude * np.cos(2 * np.pi * np.arange(count) / count)[None, None]
    force = large.friction(slide, np.array([stiffness]), np.array([limit]))
    work = ((force + np.roll(force, -1)) / 2 * (np.roll(slide, -1) - slide)).sum()
    assert work == pytest.approx(4 * limit * (amplitude - limit / stiffness), rel=1e-6)


def held(rows) -> bool:
    return len(rows) > 1 and all(abs(true - value) <= bar + own for _, _, true, own, value, bar in rows)


def test_always_the_bars_of_a_coarse_joint_hold_all_of_it(large, monkeypatch):
    monkeypatch.setattr(large, "TOP", 21)
    monkeypatch.setattr(large, "SAMPLES", 1024)
    assert held(large.compare("lap joint", 11, True, 1, ("free-interface",)))


LOSSY = ("Abaqus, 16 digits", "DMIG, fields of 16", "OUTPUT4 binary, single precision", "DMIG, fields of 8")


def test_exact_each_format_brings_a_beam_whole_or_says_what_it_lacks(formats):
    """Formats in double precision give the same bits; 16 digits of Abaqus change no entry by more than round-off; where
    frequencies move by more than 1e-5 the run says by how much they may, or finds no stiffness."""
    for row in formats.main(10, 1):
        if row.name not in LOSSY:
            assert row.off == 0.0, row
        elif "16 digits" in row.name:
            assert row.off < 5e-16 and row.first < 1e-9, row
        else:
            assert 1e-12 < row.off < 1e-2 and (row.first < 1e-5 or "uncertain by" in row.says or np.isinf(row.first)), \
                row
            assert "e+" not in row.says, row  # a percentage is read without a power of ten


def test_exact_pynastran_writes_what_is_read_here_and_reads_what_the_study_writes(formats, tmp_path):
    try:
        peer = formats.Peer("pyNastran", "substructures/pynastran_child.py", "PATCHFEM_NASTRAN_PYTHON",
                            sys.executable, "")
    except Missing as absent:
        pytest.skip(str(absent))
    whole = formats.beam(6, 1).stiffness
    np.save(tmp_path / "k.npy", whole.toarray())
    for name, text in (("binary.op4", False), ("text.op4", True)):
        formats.output4(tmp_path / name, {"K": whole}, text)
    with peer:
        found = peer.ask(matrix=str(tmp_path / "k.npy"), folder=str(tmp_path), read=["binary.op4", "text.op4"])
    assert found["off"] == {"binary.op4": 0.0, "text.op4": 0.0}
    for name in found["written"]:
        read = formats.matrices.read(tmp_path / name, "stiffness").values
        digits = 1e-9 if name.endswith(".pch") else 0.0
        assert abs(read - whole).max() <= digits * abs(whole).max(), name


ELEMENTS = {"mass on Iwan's law": 1e-5}  # of the value, what 48 elements in place of the law make


@pytest.mark.parametrize("name", ["three blades", "mass on Iwan's law", "beam under tanh"])
def test_exact_other_programs_read_the_export_and_find_the_same_motion(readers, name):
    if not {readers.NLVIB, "PATCHFEM_TMDSIMPY_PYTHON"} & set(os.environ):
        pytest.skip(f"{readers.NLVIB} and PATCHFEM_TMDSIMPY_PYTHON name no peer")
    try:
        mine, *others = readers.compare(name)
    except Missing as absent:
        pytest.skip(str(absent))
    for one in others:
        assert abs(one.value - mine.value) <= mine.error + one.error + ELEMENTS.get(name, 1e-8) * mine.value, one


def test_refuses_peers_that_are_not_there_by_name(readers, monkeypatch, tmp_path):
    monkeypatch.setenv(readers.NLVIB, "/nowhere")
    with pytest.raises(Missing, match=readers.NLVIB):
        readers.by_nlvib(tmp_path, 5, 64)
    monkeypatch.delenv("PATCHFEM_DATA", raising=False)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Missing, match="PATCHFEM_DATA"):
        readers.beam(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lap joint", "three blades"])
def test_always_the_bars_of_a_large_structure_hold_all_of_it(large, name):
    assert held(large.compare(name, 11, False, 1, ("free-interface",)))
