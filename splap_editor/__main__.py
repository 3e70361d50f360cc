"""``python -m splap_editor`` is ``splap-editor``."""

import sys

from splap_editor.cli import main

if __name__ == "__main__":
    sys.exit(main())
