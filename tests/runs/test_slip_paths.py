"""The slip path of a cycle read from frames: what reversals between them hide lies in its error."""

from types import SimpleNamespace

import numpy as np
import pytest

from patchfem.runs.wear.slip import Frames, compute_frame_slip, count_frames

PHASES = np.linspace(0, 1, 41)


def turning(angle):
    """A slip whose turns are sharper than those of a sine, as of a block that stops hard, at angles [rad]."""
    return np.arcsin(0.98 * np.sin(angle)) * 2 / np.pi


@pytest.mark.parametrize(
    "slip, path",
    [
        (np.sin, 4.0),
        (turning, 8 / np.pi * np.arcsin(0.98)),
        (lambda a: np.clip(np.sin(a), -0.8, 0.8), 3.2),
        (lambda a: np.abs((a / np.pi) % 2 - 1), 2.0),
    ],
    ids=["sine", "sharp", "held", "triangle"],
)
@pytest.mark.parametrize("energy", [False, True])
def test_always_the_error_of_a_path_holds_what_its_frames_hide(slip, path, energy):
    """At every phase of the frames; where every second frame alone was asked, a turn half way between hid itself."""
    model = SimpleNamespace(wear=SimpleNamespace(uses_friction_work=energy), grooves=None)
    interface = SimpleNamespace(weight=np.array([1.0, 3.0]))
    patch = SimpleNamespace(
        pressure=SimpleNamespace(sigma_n=np.array([2.0, 1.0])),
        x=np.array([0.0, 1.0]),
        pieces=SimpleNamespace(interface=interface),
    )
    for count in (60, 61, 157):
        for phase in PHASES:
            angle = 2 * np.pi * (np.arange(count) + phase) / count
            local = np.outer(slip(angle), [1.0, 1.0])
            tau = np.tile(patch.pressure.sigma_n, (count, 1))
            found = compute_frame_slip(model, patch, Frames(local, tau, is_closed=True))
            off = abs(found.path[0] / path - 1)
            assert off <= found.error + 1e-12 and found.error < 5 / count
            assert found.path[1] == pytest.approx(found.path[0], rel=1e-12)


def test_order_frames_grow_as_the_root_of_the_tolerance():
    assert count_frames(1e-2) == 223 and count_frames(1e-3) / count_frames(1e-2) == pytest.approx(
        10**0.5, rel=0.01
    )
    assert count_frames(1e-9) == 800
