"""Motion of a rig or a bench: modes, drive and contact, or contact under a prescribed slide.

In: a Model with a rig or a slide, and its Patch. Out: a Result.

Start reading at `rig`. It runs the model with finer and finer numerical settings until the errors meet the tolerance,
and then completes the result. The run and its coarse runs are each solved only once, by the engine. `engines` has the
numerical settings, and `comparisons` the coarser runs from which the errors follow. `scene.rules.methods.ENGINE_SUPPORT`
lists what each engine can compute, and `runs.plan` the memory of its histories.

Each engine has a module (`march`, `event_to_event` for the engine `event_driven`, `slides` for a bench, and the folder
`steady`), which prepares the integration in `time_steps` or `event_driven` and contains the measures that the engine
computes itself. `evaluation` converts a run to a Solution, and `levels` continues a run from drive level to drive level.
`joints` makes the laws of the engine `event_driven` from the interfaces of a model (`interfaces.joints`).
"""
