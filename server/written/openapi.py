"""Writes the API's OpenAPI description, of which the pages' types are made: `python -m server.written.openapi [FILE]`."""

import json
import sys
from pathlib import Path

from server.app import describe


def description() -> str:
    """The description as JSON, the same for the same routes."""
    document = describe().openapi()
    # A new commit that changes no route must not change the generated types.
    document["info"]["version"] = "0"
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(description())
    else:
        sys.stdout.write(description())
