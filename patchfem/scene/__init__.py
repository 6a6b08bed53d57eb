"""Reading of scenes: a TOML file becomes a `Scene` in SI units; all mistakes are listed.

In: text of a scene and --set words. Out: `Scene`, frozen tables of SI values with the line of every key.
`keys/` holds the keys and their kinds, `rules/` what excludes or needs what, `text` the resolved scene.
Read `scene` first, then `keys/tables`. README.md in this folder explains every key.
"""

# Names that other folders use, by module.
PUBLIC = {
    "assignments": (
        "Axis",
        "BOUNDS_FORM",
        "LIST_FORM",
        "RANDOM_FORM",
        "Range",
        "make_axis",
        "read_assignments",
        "POSITIVE_KEYS",
        "read_positive_values",
    ),
    "backbone_scene": (
        "BackboneTables",
        "GivenMode",
        "parse_modes",
    ),
    "files": (
        "file_exists",
        "list_named_files",
        "require_files",
    ),
    "joint_laws": (
        "KNOWLEDGE_OF_JOINT",
        "WISHES_FOR_LAW",
        "choose_law",
        "compose_scene",
    ),
    "keys.contact": (
        "Asperities",
        "Coating",
        "Contact",
        "Material",
    ),
    "keys.lookup": ("find_key",),
    "keys.materials": ("MATERIALS",),
    "keys.memoize": ("memoize",),
    "keys.quantities": (
        "NUMBER_PATTERN",
        "UNIT_FACTORS",
        "parse_quantity",
    ),
    "keys.removed": ("describe_removed", "refuse_attribute", "refuse_removed"),
    "keys.tables": (
        "Drive",
        "Friction",
        "Structure",
        "Tables",
    ),
    "keys.types": ("Key", "advise_on_name", "list_keys"),
    "lines": (
        "find_scene_value",
        "locate_key",
        "number_items_from_one",
        "split_assignment",
        "split_key",
    ),
    "overrides": (
        "BaseScene",
        "PlainNumbers",
    ),
    "rules.accuracy": (
        "has_effect",
        "list_fixed_settings",
    ),
    "rules.methods": (
        "ENGINE_SUPPORT",
        "Joint",
        "MotionFeatures",
        "find_unsupported_feature",
    ),
    "scene": (
        "Scene",
        "load",
        "loads",
        "read_sweep_axes",
    ),
    "schema": ("make_schema",),
    "sets": (
        "find_oversized_lengths",
        "format_assignments",
        "format_scene",
        "format_values",
        "require_units",
    ),
    "starting": (
        "NEXT_VERB_BY_KIND",
        "TEMPLATE_DESCRIPTIONS",
        "find_shipped_scene",
        "read_template",
    ),
    "text": ("format_toml",),
    "toml_text": ("read_text",),
}
