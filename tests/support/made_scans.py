"""Scan alignments with a given map of depths, as if position and reference plane were known."""

import numpy as np
from patchfem.surface.compare.robust import MAX_UNWORN
from patchfem.surface.scans.alignment import ScanAlignment
from patchfem.surface.scans.errors import draw_scan_errors
from patchfem.surface.scans.wear import find_change


def make_alignment(depth, noise: float) -> ScanAlignment:
    """Return the alignment of two scans whose depths (m, n) [m] have noise of a standard deviation [m]."""
    with np.errstate(invalid="ignore"):
        used = np.abs(depth) <= MAX_UNWORN * noise
    worn, grown = find_change(depth, used, noise)
    used &= ~worn & ~grown
    return ScanAlignment(
        placement=None,
        state=np.zeros(6),
        depth=depth,
        noise=noise,
        unworn=used,
        worn=worn,
        grown=grown,
        region=np.ones(depth.shape, bool),
        covariance=np.zeros((3, 3)),
        errors=draw_scan_errors(depth, used, np.zeros(3)),
        correlation=1.0,
    )
