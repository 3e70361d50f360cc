"""The window: PySide6 widgets over the models below."""
