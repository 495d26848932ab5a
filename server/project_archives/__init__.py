"""A whole project in one file, out of one server and into another."""
