"""Reading of scenes: a TOML file becomes a `Scene` in SI units; all mistakes are listed.

In: text of a scene and --set words. Out: `Scene`, frozen tables of SI values with the line of every key.
`keys/` holds the keys and their kinds, `rules/` what excludes or needs what, `text` the resolved scene.
Read `scene` first, then `keys/tables`. README.md in this folder explains every key.
"""

# Names that other folders use, by module.
PUBLIC = {
    "assignments": (
        "BOUNDS_FORM",
        "LIST_FORM",
        "RANDOM_FORM",
        "Range",
        "read_assignments",
    ),
    "backbone_scene": ("parse_modes",),
    "files": (
        "list_named_files",
        "require_files",
    ),
    "joint_laws": (
        "choose_law",
        "compose_scene",
    ),
    "keys.contact": (
        "Coating",
        "Material",
    ),
    "keys.materials": ("MATERIALS",),
    "keys.quantities": (
        "UNIT_FACTORS",
        "parse_quantity",
    ),
    "keys.removed": ("describe_removed", "refuse_attribute", "refuse_removed"),
    "keys.tables": (
        "Friction",
        "Tables",
    ),
    "keys.types": ("advise_on_name",),
    "overrides": ("BaseScene",),
    "scene": (
        "Scene",
        "load",
        "loads",
    ),
    "schema": ("make_schema",),
    "sets": ("format_assignments",),
    "starting": (
        "NEXT_VERB_BY_KIND",
        "TEMPLATE_DESCRIPTIONS",
        "read_template",
    ),
    "toml_text": ("read_text",),
}
