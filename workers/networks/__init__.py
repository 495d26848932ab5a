"""The networks: as modules, as layouts of arrays, and as compiled passes."""
