"""Splats as files hold them, and the ellipses that they occupy."""
