"""The compiled inner loop: sensing, rewards, observations and resets of all robots in one call."""
