"""What is drawn in 3D: the scene of live views and replays."""
