"""The coupled run: modes, drive and contact.

Read `rig` first, then `interface` (where the friction of a patch becomes the contact that an engine moves).
"""
