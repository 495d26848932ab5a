"""The gallery: arenas built in, generated and imported, drawn before anybody trains on them."""
