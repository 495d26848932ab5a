"""`python -m workers.export CHECKPOINT`: the export command on its own, for whoever starts it as a process."""

import typer

from workers.export.command import export

if __name__ == "__main__":
    typer.run(export)
