"""``splap-editor doctor`` and ``splap-editor integrate``."""

import argparse
import json
from typing import Any

NAMES = ("doctor", "integrate")


def add_commands(commands: Any) -> None:
    """Add both to the subparsers of the command line."""
    doctor = commands.add_parser("doctor", help="check what the program needs from this computer")
    doctor.add_argument("--json", action="store_true", help="one JSON object on standard output")
    doctor.set_defaults(run=_doctor)
    integrate = commands.add_parser("integrate", help="put the program among this user's applications (Linux)")
    integrate.add_argument("--remove", action="store_true", help="take it away again")
    integrate.set_defaults(run=_integrate)


def _doctor(options: argparse.Namespace) -> int:
    from splap_editor.installation.doctor import examination
    from splap_editor.installation.readiness import NotReadyError

    found = examination()
    if options.json:
        print(json.dumps(found))
        return 2 if found["problem"] else 0
    problem = found.pop("problem")
    print("\n".join(_lines(found)))
    if problem:
        raise NotReadyError(problem)
    print("ready: the window can be opened")
    return 0


def _lines(found: dict[str, Any], indent: str = "") -> list[str]:
    lines = []
    for name, value in found.items():
        label = f"{indent}{name}"
        if isinstance(value, dict):
            lines += [f"{label}:", *_lines(value, f"{indent}  ")] if value else [f"{label}: none"]
        elif isinstance(value, list):
            lines.append(f"{label}: {', '.join(value) or 'none'}")
        else:
            lines.append(f"{label}: {'missing' if value is None else value}")
    return lines


def _integrate(options: argparse.Namespace) -> int:
    from splap_editor.installation.desktop_entry import integrate, remove

    files = remove() if options.remove else integrate()
    for path in files:
        print(f"{'removed' if options.remove else 'wrote'} {path}")
    if not files:
        print("nothing to remove")
    return 0
