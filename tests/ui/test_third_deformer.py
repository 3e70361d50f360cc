"""A deformer that is a module and a row is in the panel, with a form of its options, and bends what is on screen."""

import numpy as np
import pytest

from splap_editor.core import deformers
from splap_editor.core.deformers import DeformerRow
from splap_editor.core.handle_nodes import Region
from splap_editor.engine.edit import Pose
from splap_editor.ui.panels.deformer_panel import DeformerPanel
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.options_form import NO_BOUND
from tests.engine.test_third_deformer import FadeOptions, bind_fade

BIND = "splap_editor.core.deformer:bind_fade"
"""A module whose source can be read for the cache's key: pytest rewrites this one."""


@pytest.fixture(scope="module")
def fade():
    row = DeformerRow("fade", "Fading translation", FadeOptions, BIND, key="fade")
    loaded = deformers.loaded
    deformers.loaded = lambda named: bind_fade if named == BIND else loaded(named)
    deformers.DEFORMERS.append(row)
    yield row
    deformers.DEFORMERS.remove(row)
    deformers.loaded = loaded


def test_choosing_it_and_changing_its_option_bends_the_scene(fade, driver):
    window, scene = driver.window, driver.scene
    panel = window.findChild(DeformerPanel)
    driver.session.steps.add_handle(Region(np.array([1.1, 0.0, 0.3]), radius=0.1), pose=Pose(translate=(0.0, 0.0, 0.2)))
    driver.wait_idle()
    panel.method.setCurrentIndex(panel.method.findData("fade"))
    assert scene.edit.method == "fade" and panel.forms[FadeOptions].isVisibleTo(panel)
    driver.wait_idle()
    whole = scene.kernels.means[:, 2] - scene.splats.means[:, 2]
    # Everything takes part, which none of the program's own deformers does in a drag so short.
    assert (whole > 0.01).all()
    power = panel.forms[FadeOptions].findChild(NumberField, "power")
    power.setValue(6.0)
    assert scene.edit.options[FadeOptions] == FadeOptions(6.0)
    driver.wait_idle()
    steeper = scene.kernels.means[:, 2] - scene.splats.means[:, 2]
    assert steeper.mean() < 0.7 * whole.mean()
    driver.session.history.undo()
    driver.wait_idle()
    np.testing.assert_allclose(scene.kernels.means[:, 2] - scene.splats.means[:, 2], whole, atol=1e-9)


def test_its_length_is_shown_in_the_units_of_the_file_or_without_bound(fade, driver):
    session, scene = driver.session, driver.scene
    panel = driver.window.findChild(DeformerPanel)
    center = np.array([1.1, 0.0, 0.3])
    session.steps.add_handle(Region(center, radius=0.1), pose=Pose(translate=(0.0, 0.0, 0.2)))
    panel.method.setCurrentIndex(panel.method.findData("fade"))
    reach = panel.forms[FadeOptions].findChild(NumberField, "reach")
    assert reach.isVisibleTo(panel) and reach.value() == pytest.approx(9.0 * scene.ellipses.scene_scale, abs=1e-4)
    reach.setValue(0.5)
    assert scene.edit.options[FadeOptions] == FadeOptions(reach=0.5) and session.history.undo_label == "Change reach"
    driver.wait_idle()
    moved = scene.kernels.means[:, 2] - scene.splats.means[:, 2] > 0.01
    apart = np.linalg.norm(scene.splats.means - center, axis=1)
    assert moved[apart < 0.4].all() and not moved[apart > 0.6].any()
    reach.setValue(reach.minimum())
    assert scene.edit.options[FadeOptions] == FadeOptions(reach=None) and reach.text() == NO_BOUND
    session.history.undo()
    assert reach.value() == 0.5
    driver.wait_idle()
