"""Selecting splats one by one."""

from splap_editor.tools.select_tool import SelectTool, picking


class ClickTool(SelectTool):
    """A click picks, and a drag moves the camera: nothing is drawn by mistake."""

    name = "click"
    bindings = picking(SelectTool.pick, "The splat under the pointer; beside it, none", "a splat", gesture="Click")
