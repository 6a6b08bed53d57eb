"""For every test: one BLAS thread, so that two cores serve two tests, and no deadline, so that a busy machine fails
nothing."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported, here and in child processes

from hypothesis import settings

settings.register_profile("patchfem", deadline=None)
settings.load_profile("patchfem")
