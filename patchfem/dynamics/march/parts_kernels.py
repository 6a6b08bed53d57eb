"""Flags of the loop for one contact under a constant load; `instances` writes others.

Numba leaves out the branches of a flag that is False, so nothing is compiled that a rig does not have.
"""

HAS_ELEMENTS = False  # there are elements, with the contact or in its place
HAS_STOPS = False  # some elements are set-valued
HAS_SLOPES = False  # some elements have a slope
HAS_CONTACT = True  # there is a contact; elements may take its place
IS_COUPLED = False  # elements and contact are more than one
HAS_PLANES = False  # some elements slide in a plane, with two directions each
LOAD_VARIES = False  # the load varies
HAS_POINTS = False  # points bear their own fraction of a load that varies
HAS_LISTS = False  # points are lists of bonds
