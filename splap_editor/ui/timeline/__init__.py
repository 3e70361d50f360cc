"""The timeline strip, playing, and frames as files."""
