"""For every test: one BLAS thread, so that two cores serve two tests, and no deadline, so that a busy machine fails
nothing. The examples of the property tests are the same in every run, so that a failure is of the change at hand;
PATCHFEM_SEARCH=1 draws new ones."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported, here and in child processes

from hypothesis import settings

from patchfem.compiled import cache_folder

os.environ.setdefault("NUMBA_CACHE_DIR", str(cache_folder()))  # else an edited kernel runs as its old self

settings.register_profile("patchfem", deadline=None, derandomize="PATCHFEM_SEARCH" not in os.environ)
settings.load_profile("patchfem")
