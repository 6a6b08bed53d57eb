"""Rules between the keys of a scene, one module per table.

In: the draft of a scene. Out: mistakes and remarks, each at the line of a key; nothing is raised here.
Read `check` first: it calls most others. `limits` and `methods` say what effects cannot do together yet, and an engine.
"""
