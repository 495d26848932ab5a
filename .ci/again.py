"""Try the few tests that failed beside other ones once more, alone, and name those that pass now.

    python .ci/again.py MOST CACHE...

Each cache is one that pytest kept of a run that failed. More failures than MOST are no matter of a busy machine: nothing is
tried then. Ends with 0 if all pass by themselves.
"""

import json
import subprocess
import sys
from pathlib import Path


def main() -> int:
    """What `make` ends with."""
    most, *caches = sys.argv[1:]
    failed = {cache: _failed(Path(cache)) for cache in caches}
    number = sum(map(len, failed.values()))
    if not 0 < number <= int(most):
        return 1
    for cache, tests in failed.items():
        options = ["-o", f"cache_dir={cache}", "--last-failed", "--last-failed-no-failures=none"]
        if tests and subprocess.run([sys.executable, "-m", "pytest", *options, *tests]).returncode != 0:
            return 1
    sys.stdout.write("Failed beside other tests and passed alone, to be mended:\n")
    for tests in failed.values():
        sys.stdout.writelines(f"  {test}\n" for test in tests)
    return 0


def _failed(cache: Path) -> list[str]:
    kept = cache / "v" / "cache" / "lastfailed"
    return sorted(json.loads(kept.read_text("utf-8"))) if kept.exists() else []


if __name__ == "__main__":
    sys.exit(main())
