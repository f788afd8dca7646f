"""Motions of LAMP, by sonar and odometry only: beside something, in open loop, through a narrow opening (card X4)."""
