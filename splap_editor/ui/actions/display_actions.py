"""How splats are drawn, by key and menu."""

from splap_editor.ui.display import Display


class DisplayActions:
    """How splats are drawn, by key and menu."""

    def __init__(self, display: Display) -> None:
        self._display = display

    def ellipses(self) -> None:
        """Draw ellipses."""
        self._display.set(mode="ellipses")

    def splats(self) -> None:
        """Draw blended Gaussians."""
        self._display.set(mode="splats")

    def points(self) -> None:
        """Draw centres."""
        self._display.set(mode="points")

    def deformed(self) -> None:
        """Show the edit."""
        self._display.set(shown="deformed")

    def original(self) -> None:
        """Show the file as it is."""
        self._display.set(shown="original")

    def both(self) -> None:
        """Show the edit over a ghost of the original."""
        self._display.set(shown="both")

    def weights(self, on: bool) -> None:
        """Show how much each splat follows the chosen handle."""
        self._display.set(weights=on)
