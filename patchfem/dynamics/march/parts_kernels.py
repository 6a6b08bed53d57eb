"""Feature flags of the march loop for one contact under a constant load.

`instances` writes modules with other flags. Numba omits the branches of a flag that is False, so features that a rig
does not have are not compiled.
"""

HAS_ELEMENTS = False  # whether there are elements, in addition to the contact or instead of it
HAS_STOPS = False  # whether some elements are set-valued
HAS_SLOPES = False  # whether the force of some elements has a slope with respect to the slide
HAS_CONTACT = True  # whether there is a contact on port 0; otherwise elements replace it
IS_COUPLED = False  # whether there is more than one element or contact
LOAD_VARIES = False  # whether the normal load varies
HAS_POINTS = False  # whether each point carries its own varying load
HAS_LISTS = False  # whether the points have bond lists
