"""The comparisons with other programs: their arithmetic, their refusals and, where a peer is installed, its answers."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from study_module import load_study, make_study_fixture

from patchfem.closed_forms import contact as exact
from patchfem.core import Missing

GETFEM = "PATCHFEM_GETFEM_PYTHON"


hertz = make_study_fixture("peers/hertz_getfem.py")


def without(name) -> bool:
    """Does this interpreter lack the package?"""
    return (
        subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True).returncode
        != 0
    )


def test_exact_errors_of_the_closed_forms_themselves_vanish():
    hertz = load_study("peers/hertz_pair.py")
    x = hertz.make_grid(16).x
    hertzian = exact.hertz_pressure(x, hertz.LOAD, hertz.RADIUS, hertz.MODULUS)
    assert np.abs(hertz.compute_errors(x, hertzian)).max() <= 1e-12
    assert hertz.compute_errors(x, 1.01 * hertzian)[0] == pytest.approx(0.01)


def test_exact_mirrored_and_twice_condensed_pairs_are_one(hertz):
    mirror = hertz.ours(4, "mirror")
    pair = hertz.ours(4, "pair")
    assert hertz.agreement(mirror, pair) <= 1e-12
    assert pair.dofs == 2 * mirror.dofs


def test_exact_getfem_finds_the_same_pressures(hertz):
    """With the corner rule both programs solve one discrete problem by different means: all three steps agree."""
    try:
        peer = hertz.Peer("GetFEM", "peers/getfem_child.py", GETFEM, "/usr/bin/python3", "")
    except Missing as absent:
        pytest.skip(str(absent))
    with peer:
        mirror = hertz.theirs(peer, 8, "mirror", "nodal")
        pair = hertz.theirs(peer, 4, "pair", "nodal")
    assert hertz.agreement(hertz.ours(8, "mirror"), mirror) <= 1e-9
    # points are looked up across the faces
    assert hertz.agreement(hertz.ours(4, "pair"), pair) <= 1e-4


@pytest.mark.share(0)
def test_refuses_an_absent_peer_by_name(hertz, monkeypatch, capsys):
    for place in ["/nowhere/python"] + [sys.executable] * without("getfem"):
        monkeypatch.setenv(GETFEM, place)
        assert hertz.run(hertz.main) == 4
        message = capsys.readouterr().err
        assert GETFEM in message
        assert place in message
        assert "getfem" in message.lower()
        assert "Traceback" not in message
