"""What a kept state of a run belongs to. It stands alone, so that a run without wear does not load it all."""

import hashlib

import numpy as np


def key_of(model, patch, version: str) -> str:
    """What a kept state belongs to: the scene in SI, the unworn gap on its nodes, a slide from a file, the version."""
    corners = () if model.slide is None or model.slide.corners is None else model.slide.corners
    of_patch = () if patch is None else (patch.x, patch.gap)
    parts = (f"{version}\n{model.source.resolved}".encode(), *of_patch, *corners)
    return hashlib.sha256(b"".join(one if isinstance(one, bytes) else np.asarray(one).tobytes()
                                   for one in parts)).hexdigest()
