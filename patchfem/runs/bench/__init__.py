"""Friction response of an interface to a prescribed relative displacement (law bench).

In: a model with [slide] and its Patch with the static contact solution, or None for a single point.
Out: a `BenchRun` with histories, output frames of the interface and measures.

`engine` chooses the method and predicts its cost. The methods are `closed_form` (laws without
memory), `rigid` (compiled kernels for a single point), `shear` (pieces that deform in shear) and
`step_by_step` (NumPy laws for varying pressure or two directions). `errors` estimates the errors
from coarser runs. Start reading at `bench`, then `engine`.
"""
