"""ROS bags: ROS 2 in MCAP and SQLite, and ROS 1."""
