"""A main thread without a window, and a worker that reports to it."""

import pytest

from splap_editor.session.jobs import Worker
from tests.session.main_thread import MainThread


@pytest.fixture
def main():
    return MainThread()


@pytest.fixture
def worker(main):
    worker = Worker(main.post)
    yield worker
    worker.close()
