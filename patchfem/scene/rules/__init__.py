"""Rules on combinations of keys of a scene, one module per table.

In: a `SceneDraft`, which holds what was written and what could be read. Out: mistakes and remarks, each with its key; the
draft finds the line, and nothing is raised here. Read `facts` first: a rule is a condition on the values of a table, with
the key and the sentence of its mistake. `check_scene` calls the modules of all tables; `together` holds the rules across
tables; `support` and `methods` say what effects and engines cannot do together yet; `needed_keys` reports the keys that
`keys.choices` requires, excludes or does not use.
"""
