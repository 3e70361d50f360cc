"""Which source made a stage: part of the name under which its result is kept."""

import hashlib
import re
from functools import cache
from importlib.abc import InspectLoader
from importlib.machinery import ModuleSpec
from importlib.util import find_spec

_IMPORT = re.compile(
    r"^[ \t]*(?:from|import)[ \t]+(splap_editor[.\w]*)(?:[ \t]+import[ \t]+(?:\(([^)]*)\)|([^\n]*)))?", re.MULTILINE
)


def source_hash(*modules: str) -> str:
    """Hash of the source of some modules and of all modules of this package that they import.

    Whoever changes a stage changes its hash, and results of the old source are no longer found. Sources are read once
    in a process. What the package depends on (numpy, scipy, …) does not count.
    """
    digest = hashlib.blake2b(digest_size=16)
    for module in sorted(with_imports(frozenset(modules))):
        digest.update(module.encode() + b"\0" + source_text(module).encode() + b"\0")
    return digest.hexdigest()


@cache
def with_imports(modules: frozenset[str]) -> frozenset[str]:
    """Some modules, and all of this package that they import, directly or not."""
    found: set[str] = set()
    waiting = list(modules)
    while waiting:
        module = waiting.pop()
        if module not in found:
            found.add(module)
            waiting += _imported(module)
    return frozenset(found)


@cache
def _imported(module: str) -> frozenset[str]:
    """Modules of this package that a module imports, anywhere in it."""
    found = set()
    for name, in_lines, in_line in _IMPORT.findall(source_text(module)):
        found.add(name)
        if _spec(name).submodule_search_locations is not None:
            members = (member.split("#")[0].split(" as ")[0].strip() for member in (in_lines or in_line).split(","))
            found.update(f"{name}.{member}" for member in members if member and find_spec(f"{name}.{member}"))
    return frozenset(found)


@cache
def source_text(module: str) -> str:
    """Text of a module, from its file or from an archive that holds it."""
    loader = _spec(module).loader
    assert isinstance(loader, InspectLoader)
    return loader.get_source(module) or ""


def _spec(module: str) -> ModuleSpec:
    spec = find_spec(module)
    if spec is None:
        raise ModuleNotFoundError(f"there is no module {module}", name=module)
    return spec
