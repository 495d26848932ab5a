"""Taking a policy away: ONNX graphs, and a bundle that drives a robot with ROS 2 or with NumPy alone.

`ros2/` is the package that ships in the bundle; its `policy`, `observation` and `navigator` need nothing but NumPy.
"""
