"""What settings are called in print: the words of the launch form, not the names of the code."""

from collections.abc import Sequence
from functools import cache
from typing import Any

from server.experiments.form import form_schema
from server.printing.values import spelled_out


def setting_words(path: str) -> str:
    """A setting as the launch form calls it, behind the heading that it stands under: "Algorithm: Discount (gamma)".

    A path that the form does not know is spelled out.
    """
    labels = _labels(tuple(path.split(".")))
    return f"{labels[-2]}: {labels[-1]}" if len(labels) > 1 else labels[-1]


@cache
def _labels(path: Sequence[str]) -> list[str]:
    schema = _form()
    labels: list[str] = []
    candidates = _branches(schema["properties"]["training"], schema)
    for key in path:
        found = [each for one in candidates if (each := one.get("properties", {}).get(key)) is not None]
        # What merely names its object's kind is called as the object.
        if not (key == "name" and labels):
            titles = [title for each in found for title in _titles(each, schema)]
            labels.append(titles[0] if titles else spelled_out(key))
        candidates = [branch for each in found for branch in _branches(each, schema)]
    return labels


@cache
def _form() -> dict[str, Any]:
    return form_schema()


def _titles(node: dict[str, Any], schema: dict[str, Any]) -> list[str]:
    own = [node["title"]] if "title" in node else []
    return [*own, *(branch["title"] for branch in _branches(node, schema) if "title" in branch)]


def _branches(node: dict[str, Any], schema: dict[str, Any]) -> list[dict[str, Any]]:
    """The objects that a setting may be; of a list of kinds, what each is, under its kind's name."""
    if "$ref" in node:
        return _branches(schema["$defs"][node["$ref"].rpartition("/")[2]], schema)
    if "items" in node and "mapping" in (discriminator := node["items"].get("discriminator", {})):
        return [{"properties": {kind: {"$ref": ref} for kind, ref in discriminator["mapping"].items()}}]
    several = node.get("oneOf") or node.get("anyOf")
    return [branch for each in several for branch in _branches(each, schema)] if several else [node]
