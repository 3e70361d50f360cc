"""What is told of keys is made from what they do."""

from tests.keys_table import README, with_keys_table


def test_the_readme_tells_the_keys_there_are():
    text = README.read_text(encoding="utf-8")
    assert text == with_keys_table(text), "run python -m tests.keys_table"
