"""`python -m workers` is the workers' part of the `mapless` command."""

from workers.cli import app

app(prog_name="mapless")
