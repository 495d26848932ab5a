"""Drives a robot with an exported policy; only `node` needs ROS, everything else Python 3.10 and NumPy."""
