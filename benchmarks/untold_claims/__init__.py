"""Three claims of the paper that nothing in it tests, each put to a small experiment: see `__main__`."""
