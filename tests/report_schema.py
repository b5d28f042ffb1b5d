"""The schema of reports, as it is installed, and what a document has that it does not describe."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from jsonschema import Draft202012Validator
from referencing import Registry, Resource
from referencing.jsonschema import DRAFT202012

SCHEMA: dict[str, Any] = json.loads(
    files("hdrusd.account").joinpath("report.schema.json").read_text(encoding="utf-8")
)
_VALIDATOR = Draft202012Validator(SCHEMA)
BATCH_SCHEMA: dict[str, Any] = json.loads(
    files("hdrusd.account").joinpath("batch.schema.json").read_text(encoding="utf-8")
)
_REGISTRY = Registry().with_resources([("report.schema.json", Resource(SCHEMA, DRAFT202012))])
_BATCH_VALIDATOR = Draft202012Validator(BATCH_SCHEMA, registry=_REGISTRY)


def batch_problems(document: dict[str, Any]) -> list[str]:
    """What of the report of many conversions its schema forbids."""
    plain = json.loads(json.dumps(document))
    return [f"{list(e.path)}: {e.message}" for e in _BATCH_VALIDATOR.iter_errors(plain)]


def problems(document: dict[str, Any]) -> list[str]:
    """What of a report, as JSON has it, its schema forbids."""
    plain = json.loads(json.dumps(document))
    return [f"{list(e.path)}: {e.message}" for e in _VALIDATOR.iter_errors(plain)]


def undescribed(document: dict[str, Any]) -> set[str]:
    """Keys of a report that its schema does not describe."""
    found = set(document) - SCHEMA["properties"].keys()
    tables = {"lights": "light", "materials": "material", "images": "image", "fix_first": "fix"}
    for key, name in (tables | {"findings": "finding"}).items():
        known = SCHEMA["$defs"][name]["properties"].keys()
        found |= {f"{key}.{k}" for row in document.get(key, []) for k in row.keys() - known}
    known = SCHEMA["properties"]["textures"]["additionalProperties"]["properties"].keys()
    found |= {
        f"textures.{k}" for row in document.get("textures", {}).values() for k in row.keys() - known
    }
    return found
