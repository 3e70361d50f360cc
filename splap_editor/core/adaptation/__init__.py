"""Splats whose ellipses follow a deformed surface."""
