"""Pages and texts about a finished campaign."""
