"""The world: arenas, robot, LiDAR, rewards, observations, Gymnasium environments and suites."""
