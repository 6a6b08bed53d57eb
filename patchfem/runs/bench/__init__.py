"""Friction response of an interface to a prescribed relative displacement (law bench).

In: a model with [slide] and its Patch with the static contact solution, or None for a single point.
Out: a `BenchRun` with histories, output frames of the interface and measures.

`engine` has the settings and the method. `slides` follows the displacement: laws without memory in closed form, parallel
elements under a constant load by Masing's rules (`masing`), others by the points of `interfaces.contact_points`, which rigs
have as well. `rig.rig` adds errors, warnings and the Result. Start reading at `bench`, then at `slides`.
"""
