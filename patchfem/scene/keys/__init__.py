"""The keys that a scene may hold: one model for each table, one attribute for each key.

The attribute is the only place where a key is described, and everything that reads, checks or documents scenes is made
from it. Read `tables` first: it holds all tables but those under [contact] (`contact`) and [accuracy] (`accuracy`).
`types` has the types of keys, `quantities` the units of each kind of quantity, `materials` the named materials,
`choices` says which keys a table needs, takes and excludes, `lines` splits dotted keys and finds their lines in a text,
`lookup` finds the type of a dotted key, and `removed` has the sentences about keys and options of earlier versions.

How to add a key
----------------
1. Write the attribute into its table. The type gives the unit and the limits (`gt`, `ge`, `lt` and `le`, in SI), the
   text is the help, and the value behind `=` is the default in SI. A key without default is required; `optional` in
   place of `key` makes a key that may be left out, and whose value is None then::

       spacing: optional(quantity("length", gt=0), "distance between two bolts; default: one bolt")

   If the help text or the `required` text of another key lists the kinds or waveforms with which a key is used, extend
   these texts by hand. A new kind of quantity needs its units and an example in units.toml.
2. If the value of the key must agree with another key, add a rule to its table in `scene.rules`; the rules of [normal],
   [slide] and [measured] stand in `rules.check`, those of the other tables in the module of their name. The condition
   reads the values of the table in SI, and is false while a value is missing::

       if patch.spacing < patch.length:
           patch.add_mistake("spacing", f"{patch.spacing:g} m is less than contact.length")

   A key that needs or excludes a key of another table, or is idle beside it, is a row of `rules.together`, such as
   `"contact.spacing & !structure": "needs [structure]"`. If the table always needs the key or an alternative, or if only
   some values of a selector such as `slide.kind` use it, add it to `KEY_SELECTORS` of `choices`; the keys of friction laws
   and waveforms stand in `effects`. A key that another key of its table needs goes into `NEEDED_KEYS`. Missing keys,
   keys that exclude one another and keys without meaning are then reported. A key whose default is not None must stand
   with the values of a selector that use it. Otherwise `scene.resolved.toml` contains its default where it has no meaning.
3. Read the value where the model is built (folder `model`). No other code reads keys of a scene. In a sweep over a key
   of `overrides.PLAIN_KEYS`, such as normal.load, these functions get arrays in place of the swept numbers
   (`model.similar_models`), so their formulas must take arrays as well.
4. Run `python tests/support/reference`, which writes the key into the pages of the reference, and add a test that the
   key changes an answer and that a wrong value is refused (`tests/scene`). `tests/scene/test_every_key.py` fails for a
   key that changes no result and causes no sentence; such a key needs a remark (`add_remark`) in its rules. `patchfem
   run` prints remarks, `patchfem plan` does not.

A key that is removed gets a row in `removed.toml` with the version that removed it and what to use instead.
"""
