"""The page of a capture: its set-up, its status, and the controls, before, during and between drives (5.3.1)."""
