"""The slip path of a cycle, computed from frames: the error covers reversals between frames."""

from types import SimpleNamespace

import numpy as np
import pytest

from patchfem.runs.wear.slip import Frames, compute_frame_slip

PHASES = np.linspace(0, 1, 41)


def slip_with_sharp_reversals(angle):
    """Return a slip with reversals sharper than those of a sine, as of a block that stops abruptly,
    at angles [rad]."""
    return np.arcsin(0.98 * np.sin(angle)) * 2 / np.pi


@pytest.mark.parametrize(
    "slip, path",
    [
        (np.sin, 4.0),
        (slip_with_sharp_reversals, 8 / np.pi * np.arcsin(0.98)),
        (lambda a: np.clip(np.sin(a), -0.8, 0.8), 3.2),
        (lambda a: np.abs((a / np.pi) % 2 - 1), 2.0),
    ],
    ids=["sine", "sharp", "held", "triangle"],
)
@pytest.mark.parametrize("energy", [False, True])
def test_always_error_of_slip_path_covers_hidden_reversals(slip, path, energy):
    """The error covers the true path for every phase of the frames. The change to every second
    frame alone would miss a reversal half-way between frames."""
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
            frame_slip = compute_frame_slip(model, patch, Frames(local, tau, is_closed=True))
            rel_difference = abs(frame_slip.path[0] / path - 1)
            assert rel_difference <= frame_slip.error + 1e-12 and frame_slip.error < 5 / count
            assert frame_slip.path[1] == pytest.approx(frame_slip.path[0], rel=1e-12)
