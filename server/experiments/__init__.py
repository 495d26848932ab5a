"""One configuration x several seeds: launched, listed, stopped, resumed, deleted."""
