"""World and robot as one simulation: clock, cameras, laser, odometry, recorder."""
