import pytest

from splap_editor.resources import resource, resource_folder, shader


def test_every_shader_is_ascii_and_its_includes_are_resolved():
    # Some drivers refuse any other byte, in comments too.
    names = sorted(path.name.removesuffix(".glsl") for path in (resource_folder() / "shaders").glob("*.glsl"))
    assert names
    for name in names:
        assert shader(name).isascii()
        assert "#include" not in shader(name)


def test_a_missing_file_says_what_to_do():
    with pytest.raises(FileNotFoundError, match="install SpLap Editor again"):
        resource("shaders", "absent.glsl")
