"""The edit in memory: scene, commands, history, jobs, cache. No Qt, no VTK."""
