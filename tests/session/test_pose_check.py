"""A pose is checked once it has settled, and what was found belongs to that pose alone."""

import pytest

from splap_editor.engine.cache import StageCache
from splap_editor.engine.deformation_check import DeformationCheck
from splap_editor.engine.edit import Pose
from splap_editor.resources import resource
from splap_editor.session import pose_check
from splap_editor.session.placement import disc_rows, rows_region
from splap_editor.session.pose_check import PoseCheck
from splap_editor.session.session import Session


@pytest.fixture
def checked(main, tmp_path, monkeypatch):
    """A session on the tube with a handle on it, and the kernels that were checked."""
    session = Session(main.post, cache=StageCache(tmp_path / "cache"))
    seen = []

    def check(surface, kernels, deformation):
        seen.append(kernels)
        return made(surface, kernels, deformation)

    made = pose_check.deformation_check
    monkeypatch.setattr(pose_check, "deformation_check", check)
    PoseCheck(session)
    session.open(resource("samples", "tube.ply"))
    main.run_until(lambda: session.state == "ready")
    scene = session.scene
    handle = session.steps.add_handle(rows_region(scene, disc_rows(scene, 0, 0.1)))
    main.run_until(lambda: scene.check is not None)
    yield session, handle, seen
    session.close()


def moved(session, handle, x):
    session.drag.preview({handle.handle_id: Pose((x, 0.0, 0.0))})
    session.drag.commit("Move handle")


def test_each_settled_pose_is_checked_once_and_frames_of_a_drag_are_not(main, checked):
    session, handle, seen = checked
    scene = session.scene
    assert seen == [scene.kernels] and scene.check.places == ()
    session.drag.preview({handle.handle_id: Pose((0.02, 0.0, 0.0))})
    before = scene.kernels
    main.run_until(lambda: scene.kernels is not before)
    assert scene.check is None and len(seen) == 1
    session.drag.commit("Move handle")
    main.run_until(lambda: scene.check is not None)
    assert seen[1:] == [scene.kernels]
    assert isinstance(scene.check, DeformationCheck)


def test_undo_forgets_what_was_found_and_checks_again(main, checked):
    session, handle, seen = checked
    moved(session, handle, 0.02)
    main.run_until(lambda: session.scene.check is not None and len(seen) == 2)
    session.history.undo()
    main.run_until(lambda: len(seen) == 3 and session.scene.check is not None)
    assert seen[2] is session.scene.kernels
