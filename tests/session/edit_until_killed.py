"""A program that edits and saves until it is killed, again and again.

For each line on standard input it forks a process that opens a capture, and
moves a handle by 1, 2, 3, … with autosave running and a save now and then.
The process tells what it is about to do and what is on disk.
"""

import os
import sys
from pathlib import Path

import numpy as np

from splap_editor.core.handle_nodes import Region
from splap_editor.engine.edit import Pose
from splap_editor.session.autosave import Autosave
from splap_editor.session.documents import Documents
from splap_editor.session.session import Session
from tests.session.main_thread import MainThread

DELAY_S = 0.002
SAVE_EVERY = 7


def tell(*words):
    os.write(1, (" ".join(map(str, words)) + "\n").encode())


def state_number(edit):
    return round(edit.handles[0].pose.translate[0]) if edit.handles else 0


def edit_forever(ply: Path, document: Path, folder: Path):
    main = MainThread()
    session = Session(main.post)
    documents = Documents(session, main.post)
    autosave = Autosave(documents, main.post, folder=folder, delay_s=DELAY_S)
    session.scene_changed.connect(session.halt)
    session.open(ply)
    main.run_until(lambda: session.scene is not None)
    kept = [0]

    def on_written(state):
        if state is not None:
            kept[0] = max(kept[0], state_number(state.edit))
            tell("kept", state_number(state.edit))

    autosave.written.connect(on_written)
    handle = session.steps.add_handle(Region(np.zeros(3), 0.1))
    number = 0
    while True:
        number += 1
        tell("does", number)
        poses = {handle.handle_id: Pose((float(number), 0.0, 0.0))}
        session.steps.change_edit(session.scene.edit.with_poses(poses), "Move handle")
        if number % SAVE_EVERY == 0:
            saved = []
            documents.saved.connect(saved.append)
            documents.save(document)
            main.run_until(lambda saved=saved: saved)
            tell("kept", number)
        elif number % 3:
            main.run_until(lambda number=number: kept[0] >= number)


if __name__ == "__main__":
    for line in sys.stdin:
        ply, document, folder = map(Path, line.rstrip("\n").split("\t"))
        child = os.fork()
        if child == 0:
            edit_forever(ply, document, folder)
        tell("child", child)
        _, status = os.waitpid(child, 0)
        tell("ended", status)
