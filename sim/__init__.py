"""The world: arenas, robot, LiDAR, rewards, observations, Gymnasium environments and suites."""

from sim.envs import registration as registration
