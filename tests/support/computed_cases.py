"""Recorder of the cases that a sweep in this process computes, which can also interrupt the sweep."""

import math

from patchfem.runs.batch import batches


class ComputedCases:
    """Record the models that sweeps compute, and interrupt a sweep after a number of chunks.

    Attributes
    ----------
    models : list
        Models in the order in which they were computed, and errors of cases that could not be built.
    chunks_before_interrupt : float
        Number of chunks that are still computed before a KeyboardInterrupt; infinite at first.
    """

    def __init__(self, monkeypatch):
        self.models = []
        self.chunks_before_interrupt = math.inf
        self._compute = batches.solve_models
        monkeypatch.setattr(batches, "solve_models", self)

    def __call__(self, models, *more):
        """Compute a chunk of models in the same way as the sweep."""
        if self.chunks_before_interrupt <= 0:
            raise KeyboardInterrupt
        self.chunks_before_interrupt -= 1
        self.models.extend(models)
        return self._compute(models, *more)

    def __len__(self) -> int:
        """Return the number of recorded models."""
        return len(self.models)
