"""The JSON schema of the case file, for editors; and the command that writes it and the manual.

`python -m hvisph.casefile.schema --write` brings `schemas/case.schema.json` and
`docs/case-file/` of a source tree up to date; without `--write` it prints the schema.
"""

import json
import sys
from pathlib import Path

from hvisph.case.case import Case
from hvisph.case.sweep import Sweep
from hvisph.core.text import Plain

DIALECT = "https://json-schema.org/draft/2020-12/schema"
IDENTIFIER = "urn:hvisph:schema:v1:"  # the version rises when a valid file becomes invalid, from release 1.0 on
BASE = {
    "type": "string",
    "description": "Another case file, relative to this one, that this one changes: mappings merge key by "
    "key, null takes a key away, another `type` replaces a block",
}


def case_schema() -> Plain:
    """Return the JSON schema of a case file."""
    case = Case.model_json_schema()
    definitions = case.pop("$defs")
    for definition in definitions.values():
        if "const" in definition.get("properties", {}).get("type", {}):
            definition["required"] = ["type", *definition.get("required", [])]
    definitions["Case"] = case
    # A file with a base may hold any part of a case: only its outermost keys can be checked.
    changes = {
        "type": "object",
        "properties": {"base": BASE} | {name: {} for name in case["properties"]},
        "additionalProperties": False,
    }
    return {
        "$schema": DIALECT,
        "$id": IDENTIFIER + "case",
        "title": "hvisph case file",
        "description": Case.__doc__,
        "if": {"required": ["base"]},
        "then": changes,
        "else": {"$ref": "#/$defs/Case"},
        "$defs": definitions,
    }


def schema_text() -> str:
    """Return the JSON schema as the text of `schemas/case.schema.json`."""
    return json.dumps(case_schema(), indent=1, ensure_ascii=False) + "\n"


def generated_files(root: Path) -> dict[Path, str]:
    """Return the files of a source tree at `root` that come from the models, with their text."""
    from .manual import case_manual

    sweep = {"$schema": DIALECT, "$id": IDENTIFIER + "sweep", "title": "hvisph sweep", **Sweep.model_json_schema()}
    return {
        root / "schemas/case.schema.json": schema_text(),
        root / "schemas/sweep.schema.json": json.dumps(sweep, indent=1, ensure_ascii=False) + "\n",
    } | {root / "docs/case-file" / name: text for name, text in case_manual().items()}


def main(arguments: list[str]) -> int:
    """Print the schema, or write all generated files with `--write`."""
    if arguments != ["--write"]:
        sys.stdout.write(schema_text())
        return 0
    for path, text in generated_files(Path(__file__).resolve().parents[2]).items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
