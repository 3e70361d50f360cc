"""Which tool is in use, and who is told first."""

from collections.abc import Mapping, Sequence

from splap_editor.session.signals import Signal
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext


class ToolManager:
    """Passes events to whoever holds the pointer, else to the standing tools, the chosen tool and navigation.

    `chosen_changed` tells of another tool in use, `hint_changed` of other words for the status line.

    Parameters
    ----------
    context : ToolContext
    tools : mapping
        The tools that can be chosen, by name.
    standing : sequence of Tool
        Asked before the chosen tool, in order: the gizmo.
    navigation : Tool
        Asked last, and first for the middle button.
    chosen : str
        The tool in use at the start.
    """

    def __init__(
        self,
        context: ToolContext,
        tools: Mapping[str, Tool],
        standing: Sequence[Tool],
        navigation: Tool,
        chosen: str,
    ) -> None:
        self.context = context
        self.tools = dict(tools)
        self.chosen_changed = Signal()
        self.hint_changed = Signal()
        self._standing = tuple(standing)
        self._navigation = navigation
        self._chosen = chosen
        self._holder: Tool | None = None
        self._over: Tool | None = None
        self._told = self.hint

    @property
    def chosen(self) -> Tool:
        """The tool in use."""
        return self.tools[self._chosen]

    @property
    def everyone(self) -> tuple[Tool, ...]:
        """All tools, in the order in which they are asked."""
        return (*self._standing, *self.tools.values(), self._navigation)

    @property
    def hint(self) -> str:
        """What to do: with what is under way or under the pointer, else with the tool in use."""
        under_way = next((tool for tool in self._standing if tool.is_active), self._over)
        return (under_way.hint if under_way in self._standing else "") or self.chosen.hint

    def choose(self, name: str) -> None:
        """Change the tool in use; what is under way is cancelled."""
        if name != self._chosen:
            self.cancel()
            self.chosen.left()
            self._chosen = name
            self.context.viewport.gizmo.is_muted = self.chosen.mutes_gizmo
            self.context.mover = self.chosen.mover
            self.context.claim(self.chosen.claim)
            self.chosen.taken_up()
            self.chosen_changed.emit()
            self._tell_hint()

    def stand(self, tool: Tool) -> None:
        """Ask another tool before all others."""
        self._standing = (tool, *self._standing)

    def cancel(self) -> None:
        """Cancel what is under way in every tool."""
        self._holder = None
        for tool in self.everyone:
            tool.cancel()
        self.context.hud.clear()
        self._tell_hint()

    def pointer(self, event: PointerEvent) -> bool:
        """Offer a pointer event; True when it was used."""
        used = self._pointer(event)
        self._tell_hint()
        return used

    def key(self, event: KeyEvent) -> bool:
        """Offer a key event; True when it was used. Escape cancels whatever is under way."""
        used = any(tool.key(event) for tool in (*self._standing, self.chosen, self._navigation))
        if not used and event.pressed and event.key == "Escape" and self._holder is not None:
            self.cancel()
            used = True
        self._tell_hint()
        return used

    def _pointer(self, event: PointerEvent) -> bool:
        if self._holder is not None:
            holder = self._holder
            if event.kind == "release" and not event.buttons:
                self._holder = None
            holder.pointer(event)
            return True
        user = next((tool for tool in self._asked(event) if tool.pointer(event)), None)
        if event.kind == "press":
            self._holder = user
        elif event.kind == "leave":
            self._over = None
        elif event.kind == "move" and user is not self._over:
            self._over = user
            # Who was not asked any more would go on showing what was under the pointer.
            asked = self._asked(event)
            for tool in asked[asked.index(user) + 1 :] if user is not None else ():
                tool.left()
        return user is not None

    def _asked(self, event: PointerEvent) -> tuple[Tool, ...]:
        if event.button == "middle":
            return (self._navigation,)
        return (*self._standing, self.chosen, self._navigation)

    def _tell_hint(self) -> None:
        hint = self.hint
        if hint != self._told:
            self._told = hint
            self.hint_changed.emit()
