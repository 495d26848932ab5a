"""Curves of runs that ended long ago give way to fewer points, where a rule says so."""
