"""A rigid slide of a law without memory, in closed form: a pressure that rides on the upper piece, a constant load.

In every step such a law carries a share of its limit, and the limit is that of the way it slides.
"""

import numpy as np

from .law import ends_of_rest, law_for, pressed
from .ledger import Slid, elastic_slip, frame_numbers, ledger_of, local_slip
from .watch import Watch


def closed(model, patch, path: tuple, frames: int, watch: Watch) -> Slid:
    """Slide the interface of a law without memory along path = (time (k,) [s], slide (k,) [m]), in closed form.

    patch: the solved Patch or None; frames: how many frames of tractions are kept.
    """
    (time, slide), (sigma, weight), law = path, pressed(model, patch), law_for(model, patch)
    limits = np.stack([law.limit(sigma, -1.0), law.limit(sigma, 1.0)])
    move = np.diff(slide)
    share = law.share(move, np.diff(time))
    if law.holds:  # the last traction stays at rest
        last = np.maximum.accumulate(np.where(move != 0, np.arange(move.size), -1))
        share = np.where(last < 0, 0.0, share[last])
    share = np.concatenate([[0.0], share])
    way = (share > 0).astype(int)
    force = share * (limits @ weight)[way]
    spent = np.append(0.0, force[1:] * move)
    losses = np.stack([np.zeros(share.size), spent], axis=1)
    at = frame_numbers(slide.size, frames)
    tau = share[at, None] * limits[way[at]]
    for k, side in ends_of_rest(model, slide).items():
        broken = law.breaking(sigma, side)
        force[k] = weight @ broken
        tau[at == k] = broken
    watch.tell(1.0)
    load = np.full(slide.size, float(weight @ sigma))
    return Slid(force, load, elastic_slip(model, slide, force, load),
                ledger_of(np.cumsum(spent), np.zeros(share.size), losses), at, tau,
                local_slip(model, slide[at], tau, sigma))
