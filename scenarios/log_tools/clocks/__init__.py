"""Clocks of a log's sensors against the odometer's: by the turns that both see, and by the times of logging."""
