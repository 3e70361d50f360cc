"""From a file to a posed file without a window: scenes, edits, poses, and what is kept of them. No Qt, no VTK."""
