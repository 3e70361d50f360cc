"""Neither the drag nor the picture runs ahead of the other."""

from types import SimpleNamespace

from splap_editor.session.signals import Signal
from splap_editor.viewport import frame_pacer
from splap_editor.viewport.frame_pacer import FramePacer


class Drag:
    """Frames of a drag: one on its way or none."""

    def __init__(self):
        self.awaits_frame = False

    def pace(self, gate):
        self.gate = gate


def paced(monkeypatch, *, is_seen=True):
    """A pacer, its drag, the frames it asked for, and a clock that stands still."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(frame_pacer, "perf_counter", lambda: clock.now)
    drag, frames = Drag(), []
    session = SimpleNamespace(drag=drag, state_changed=Signal())
    return FramePacer(session, lambda: frames.append(clock.now), lambda: is_seen), drag, frames, clock


def test_a_frame_waits_for_the_pose_on_its_way_but_not_for_long(monkeypatch):
    pacer, drag, frames, clock = paced(monkeypatch)
    pacer()
    drag.awaits_frame = True
    pacer()
    assert len(frames) == 1
    clock.now += 2 * frame_pacer.PATIENCE_S
    pacer()
    assert len(frames) == 2


def test_a_pose_waits_until_the_frame_before_is_drawn(monkeypatch):
    pacer, drag, _, _ = paced(monkeypatch)
    shown = []
    drag.gate(lambda: shown.append("first"))
    assert shown == ["first"], "no frame is due"
    pacer()
    drag.gate(lambda: shown.append("second"))
    assert shown == ["first"]
    pacer.drawn()
    assert shown == ["first", "second"]
    pacer.drawn()
    assert shown == ["first", "second"]


def test_a_hidden_window_holds_nothing_back(monkeypatch):
    pacer, drag, _, _ = paced(monkeypatch, is_seen=False)
    shown = []
    pacer()
    drag.gate(lambda: shown.append("pose"))
    assert shown == ["pose"]
