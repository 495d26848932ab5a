"""The findings as people and programs read them."""

import json
from dataclasses import asdict

from server.doctor.checks import examine
from server.settings import Settings


def report(settings: Settings, *, as_json: bool) -> tuple[str, bool]:
    """What was found, as text, and whether all is well.

    Args:
        settings: of the installation.
        as_json: `{"ok": ..., "findings": [{"name", "ok", "found", "advice"}]}` in place of lines.
    """
    findings = examine(settings)
    well = all(finding.ok for finding in findings)
    if as_json:
        return json.dumps({"ok": well, "findings": [asdict(finding) for finding in findings]}, indent=2), well
    lines = []
    for finding in findings:
        lines.append(f"{'ok  ' if finding.ok else 'FAIL'}  {finding.name:<10} {finding.found}")
        if finding.advice is not None:
            lines.append(f"{'':<17}{finding.advice}")
    return "\n".join(lines), well
