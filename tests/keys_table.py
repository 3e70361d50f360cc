"""The README's table of keys, made from the tables of tools and actions.

``python -m tests.keys_table`` writes it into the README.
"""

from pathlib import Path

from splap_editor.ui.actions.action_table import ACTIONS
from splap_editor.ui.gestures import key_blocks

README = Path(__file__).parents[1] / "README.md"
START, END = "<!-- keys: python -m tests.keys_table -->\n", "<!-- end of keys -->\n"


def keys_table() -> str:
    """Markdown: a line for each block of the help sheet."""
    lines = ["| | |", "|---|---|"]
    for title, rows in key_blocks(ACTIONS).items():
        told = " · ".join(f"`{keys}` {what[:1].lower()}{what[1:]}" for keys, what in rows)
        lines.append(f"| {title} | {told} |")
    return "\n".join(lines) + "\n"


def with_keys_table(text: str) -> str:
    """Put the table between the marks of a README."""
    return with_block(text, START, keys_table(), END)


def with_block(text: str, start: str, block: str, end: str) -> str:
    """Put a block between two marks of a text."""
    before, _, rest = text.partition(start)
    _, _, after = rest.partition(end)
    return f"{before}{start}{block}{end}{after}"


if __name__ == "__main__":
    README.write_text(with_keys_table(README.read_text(encoding="utf-8")), encoding="utf-8")
