"""`python -m mapless_client`."""

from mapless_client.command import main

main()
