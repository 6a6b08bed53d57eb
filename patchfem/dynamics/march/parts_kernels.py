"""Feature flags of the march loop for one contact under a constant load.

`instances` writes modules with other flags. Numba omits the branches of a flag that is False, so features that a rig
does not have are not compiled.
"""

HAS_ELEMENTS = False  # whether there are elements, with the contact or in its place
HAS_STOPS = False  # whether some elements are set-valued
HAS_SLOPES = False  # whether some elements have a force-slide slope
HAS_CONTACT = True  # whether there is a contact on port 0; elements may take its place
IS_COUPLED = False  # whether there is more than one element or contact
HAS_PLANES = False  # whether some elements slide in a plane, with two directions each
LOAD_VARIES = False  # whether the normal load varies
HAS_POINTS = False  # whether points carry their own fraction of a varying load
HAS_LISTS = False  # whether the points have lists of bonds
