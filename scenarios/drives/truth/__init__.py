"""True poses of a drive against its odometry: the way they tell, their clock, and odometry told twice."""
