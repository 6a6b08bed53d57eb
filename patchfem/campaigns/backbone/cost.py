"""Backbone of the first mode as what `cost` computes with each numerical setting."""

import numpy as np

from ...core import NotConverged
from ...formatting import format_length
from ...model.model import Model
from ...runs.patch import store
from ..cost import SolvedSetting, Subject
from ..numerical_settings import TOLERANCES, find_applicable_settings
from .amplitudes import estimate_curve, find_default_range
from .curves import compute_backbone
from .joint import build_joint

N_AMPLITUDES = (
    5  # largest number of points of each curve, so that its time is that of a few motions
)
# Settings of a run that change a backbone; the others are those of its drive
BACKBONE_SETTINGS = ("element_size", "cells")
# Sentence for the user on the runs
NOTE = (
    "Each run is the backbone of the first mode at these amplitudes: {amplitudes}. Its motions have steps of the same "
    "tolerance in all runs, so that the mesh of a patch carries the error; without a patch all runs are equal."
)


def make_backbone_subject(model: Model) -> Subject:
    """Return the backbone of the first mode of a model at up to N_AMPLITUDES amplitudes as the subject of `cost`.

    The amplitudes are those of this model in all computations. Amplitudes at which it has no motion are left out: the
    search for a motion that does not exist takes most of the time, and no measure is read there.
    """
    joint = build_joint(model, "")
    amplitudes = np.geomspace(*find_default_range([joint]), N_AMPLITUDES)
    known = estimate_curve(joint._replace(has_force=False), amplitudes)
    if known is not None:
        amplitudes = known.amplitude

    def solve(changed: Model) -> SolvedSetting:
        """Return frequency, damping and force of the curve, and the frequency with a sticking contact."""
        store.clear_cache()
        backbone = compute_backbone(changed, "", amplitudes)
        curve = backbone.best
        if curve is None:
            raise NotConverged("; ".join(backbone.missing.values()))
        patch = build_joint(changed, "").patch
        return SolvedSetting(curve.list_measures(), n_nodes=None if patch is None else patch.x.size)

    def find_settings(changed: Model) -> list[str]:
        """Return the settings of the mesh of a model."""
        return [name for name in find_applicable_settings(changed) if name in BACKBONE_SETTINGS]

    note = NOTE.format(amplitudes=", ".join(format_length(one, 3) for one in amplitudes))
    return Subject(find_settings, solve, TOLERANCES, (note,))
