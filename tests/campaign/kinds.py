"""The kinds of file that are tried: a row for each, those of splats made from the program's own table of formats."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from splap_editor.io.formats.table import FORMATS
from tests.campaign import checks, seeds
from tests.campaign.mutations import BYTES, DOCUMENT, PACKED, TEXT, Mutation, chosen_of, mutated


@dataclass(frozen=True)
class Kind:
    """One kind of file.

    Parameters
    ----------
    suffix : str
        Ending of its files' names.
    made : callable (int) → bytes
        A sound file, from a number.
    mutations : tuple of Mutation
        What is done to it; one that stands there twice is done twice as often.
    is_accepted : callable (Path, int) → bool
        Reads an input of a number, and goes on with what is accepted.
    share : int
        How often it is tried, beside the others.
    is_shown : bool
        Whether a window opens it.
    """

    suffix: str
    made: Callable[[int], bytes]
    mutations: tuple[Mutation, ...]
    is_accepted: Callable[[Path, int], bool]
    share: int = 1
    is_shown: bool = False


KINDS: dict[str, Kind] = {
    "recipe": Kind(".json", seeds.recipe, DOCUMENT, checks.check_recipe, share=2),
    "session": Kind(".splap", seeds.session, DOCUMENT, checks.check_session),
    "npz": Kind(".npz", seeds.npz, (*BYTES, *BYTES), checks.check_npz),
    "cache": Kind(".npz", seeds.npz, (*BYTES, *BYTES), checks.check_cache),
}
for row in FORMATS.values():
    if row.is_ply:
        KINDS[row.name] = Kind(
            row.suffixes[0], seeds.splat_file(row), TEXT, checks.check_ply, 3 if row.is_lossless else 1, True
        )
    elif row.name == "sog-folder":
        KINDS[row.name] = Kind(".zip", seeds.splat_file(FORMATS["sog"]), PACKED, checks.check_folder)
    else:
        KINDS[row.name] = Kind(row.suffixes[0], seeds.splat_file(row), PACKED, checks.check_splats, is_shown=True)


def in_turn(names: Iterable[str]) -> list[str]:
    """Names of kinds in the order in which they are tried, again and again, each as often as its share."""
    return [name for name in names for _ in range(KINDS[name].share)]


def input_of(seed: int, kind: str, number: int, left_out: tuple[int, ...] = ()) -> tuple[bytes, list[str]]:
    """The input of a number and the mutations that made it; some may be left out, to find those that matter."""
    rng = np.random.default_rng([seed, number])
    chosen = chosen_of(KINDS[kind].mutations, rng)
    kept = [mutation for i, mutation in enumerate(chosen) if i not in left_out]
    data = KINDS[kind].made(int(rng.integers(2**31)))
    return mutated(data, kept), [mutation.__name__ for mutation, _ in kept]


def written_input(folder: Path, seed: int, kind: str, number: int, left_out: tuple[int, ...] = ()) -> Path:
    """Write the input of a number to a file."""
    data, _ = input_of(seed, kind, number, left_out)
    path = folder / f"scene{KINDS[kind].suffix}"
    path.write_bytes(data)
    return path
