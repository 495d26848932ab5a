"""`python -m workers` is the workers' part of the `mapless` command."""

from sim.parts import explained

with explained("worker"):
    from workers.cli import app

    app(prog_name="mapless")
