"""What the pointer does: tools turn pointer events into commands."""
