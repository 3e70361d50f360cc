"""What the mouse, the trackpad and single keys do: the second half of the help sheet."""

GESTURES: dict[str, tuple[tuple[str, str], ...]] = {
    "Look around": (
        ("Middle drag", "Orbit"),
        ("Left drag on empty space", "Orbit; by preference anywhere"),
        ("Shift + middle drag", "Pan"),
        ("Ctrl + middle drag, wheel", "Zoom to the pointer"),
        ("Two fingers", "Orbit; with Shift pan"),
        ("Pinch", "Zoom"),
    ),
    "Handles": (
        ("Click", "Place a handle, or choose one"),
        ("Drag arrow, square, dot", "Move along an axis, in a plane, on the screen"),
        ("Drag ring, box", "Turn, scale"),
        ("G, R, S", "Move, turn, scale with the pointer"),
        ("… then X, Y, Z", "Lock to an axis; with Shift to a plane"),
        ("… then a number", "By exactly so much"),
        ("Ctrl, Shift", "Snap, fine"),
        ("Return or click, Esc", "Take it, drop it"),
        ("Ctrl + wheel, [ ]", "Reach of the next handle"),
    ),
    "Select": (
        ("Click, drag", "Splats under the pointer, in the frame, lasso or brush"),
        ("Shift", "Add"),
        ("Ctrl", "Remove"),
        ("Shift + Ctrl", "Keep only what is in both"),
        ("Wheel with the brush", "Size of the brush"),
    ),
    "Inspect": (
        ("Click a splat, a line", "Its card and neighbours, its edge"),
        ("X", "Cut the edge"),
        ("Esc", "Let go of the edge, then of the splat"),
        ("Drag over the histogram", "Select by value; Shift adds, Ctrl removes"),
        ("Drag the marks below it", "Ends of the colours; double click resets"),
    ),
    "Frames": (
        ("Drag the line", "Look at a frame"),
        ("Drag a diamond, Esc", "Move a key, drop it where it was"),
        ("Right click on a diamond", "Delete the key"),
    ),
    "Look": (("Hold O", "Show the original"),),
    "Numbers": (("Drag a label sideways", "Change the number"),),
}
