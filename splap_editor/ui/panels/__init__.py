"""The docked panels of the window."""
