"""Health of sensors: each alone, and against each other, from the views in their order (docs/sensor-faults.md)."""
