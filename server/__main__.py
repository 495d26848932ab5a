"""`python -m server` is the `mapless` command."""

from server.cli import main

main()
