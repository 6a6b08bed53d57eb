"""Comparison with other programs: error measures, messages, and results of an installed GetFEM."""

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


def is_not_installed(name) -> bool:
    """Return whether this interpreter cannot import the package."""
    return (
        subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True).returncode
        != 0
    )


def test_exact_hertz_pressure_has_no_error():
    """The closed form of Hertz has no error; 1.01 times the pressure has an error of 0.01."""
    hertz = load_study("peers/hertz_pair.py")
    x = hertz.make_grid(16).x
    hertzian = exact.hertz_pressure(x, hertz.LOAD, hertz.RADIUS, hertz.MODULUS)
    assert np.abs(hertz.compute_errors(x, hertzian)).max() <= 1e-12
    assert hertz.compute_errors(x, 1.01 * hertzian)[0] == pytest.approx(0.01)


def test_exact_mirrored_and_condensed_pairs_agree(hertz):
    """A mirrored body and two condensed bodies give the same pressures within 1e-12."""
    mirror = hertz.ours(4, "mirror")
    pair = hertz.ours(4, "pair")
    assert hertz.agreement(mirror, pair) <= 1e-12
    assert pair.dofs == 2 * mirror.dofs


def test_exact_getfem_gives_the_same_pressures(hertz):
    """GetFEM and patchfem give the same contact pressures with nodal integration."""
    try:
        peer = hertz.Peer("GetFEM", "peers/getfem_child.py", GETFEM, "/usr/bin/python3", "")
    except Missing as absent:
        pytest.skip(str(absent))
    with peer:
        mirror = hertz.theirs(peer, 8, "mirror", "nodal")
        pair = hertz.theirs(peer, 4, "pair", "nodal")
    assert hertz.agreement(hertz.ours(8, "mirror"), mirror) <= 1e-9
    # GetFEM searches the contact points across the faces
    assert hertz.agreement(hertz.ours(4, "pair"), pair) <= 1e-4


@pytest.mark.share(0)
def test_refuses_missing_getfem(hertz, monkeypatch, capsys):
    """Without GetFEM the study ends with exit code 4 and a message that names it."""
    for place in ["/nowhere/python"] + [sys.executable] * is_not_installed("getfem"):
        monkeypatch.setenv(GETFEM, place)
        assert hertz.run(hertz.main) == 4
        message = capsys.readouterr().err
        assert GETFEM in message
        assert place in message
        assert "getfem" in message.lower()
        assert "Traceback" not in message
