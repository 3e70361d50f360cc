"""The check of the pose on screen, made in the background once the pose has settled."""

from splap_editor.engine.deformation_check import DeformationCheck, deformation_check
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session


class PoseCheck:
    """Keeps `Scene.check` that of the settled pose; there is none while the pose is on its way or at rest.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._job = LatestJob(session.detail_worker, "check", cancels=True)
        SceneFollower(session, self._job.drop, pose_changed=self._job.drop, surface_changed=self._job.drop)
        session.state_changed.connect(self._on_state_changed)

    def _on_state_changed(self) -> None:
        scene = self._session.scene
        if self._session.state != "settled" or scene is None or scene.check is not None:
            return
        surface, kernels, deformation = scene.surface, scene.kernels, scene.deformation
        if self._job.wanted is kernels:
            return
        if surface is None or kernels is None or deformation is None:
            return

        def take(check: DeformationCheck) -> None:
            if self._session.scene is scene and scene.kernels is kernels:
                scene.set_check(check)

        self._job.ask(lambda job: deformation_check(surface, kernels, deformation), take, wanted=kernels)
