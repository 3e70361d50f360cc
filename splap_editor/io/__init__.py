"""Files: splat PLYs in every layout that trainers write, and recipes (JSON edits)."""
