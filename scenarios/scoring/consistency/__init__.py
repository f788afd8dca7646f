"""Figures that need no truth: answers compared with odometry, with each other, and with their own doubt."""
