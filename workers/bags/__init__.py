"""Recordings of robots (bags): read, their sensors and motion fitted, a policy held beside what the robot did."""
