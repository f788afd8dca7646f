"""Range and inertial sensors."""
