"""Array archives (``.npz``) read within limits, whatever their bytes are."""

import re
import zipfile
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Cancelled, Progress, no_progress

_MAGIC = b"\x93NUMPY"
_LONGEST_HEADER = 4096
_MOST_MEMBERS = 256
# What numpy writes for plain numbers, and nothing else: no expression is ever evaluated.
_HEADER = re.compile(
    rb"\{'descr': '([<>|][biuf][1248])', 'fortran_order': (True|False), "
    rb"'shape': \(((?:\d{1,15}, ?)*(?:\d{1,15})?)\),? ?\} *\n"
)


class NpzError(ValueError):
    """An archive that cannot be read; the message says why, in a few words."""


class NpzFile:
    """An open ``.npz`` archive of plain numeric arrays.

    Nothing is allocated that the archive's bytes do not bear out: the size of
    an array must be that of its member, and members are bounded before they
    are unpacked.

    Parameters
    ----------
    file : BinaryIO
        Seekable; may have other bytes before the archive. The caller closes it.
    most_bytes : int
        Largest sum of the arrays that are read, unpacked.
    progress : Progress
        Told the share of an array for each MiB of it; may cancel.

    Raises
    ------
    NpzError
        It is no archive.
    OSError
        It cannot be read.
    """

    def __init__(self, file: BinaryIO, most_bytes: int, progress: Progress = no_progress) -> None:
        self._left = most_bytes
        self._progress = progress
        self._archive = _guarded(lambda: zipfile.ZipFile(file))
        members = self._archive.infolist()
        if len(members) > _MOST_MEMBERS:
            raise NpzError(f"it holds {len(members):,} members and at most {_MOST_MEMBERS} are read")
        self._members = {member.filename.removesuffix(".npy"): member for member in members}
        if len(self._members) < len(members):
            raise NpzError("two of its arrays have the same name")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the arrays."""
        return tuple(self._members)

    def shape(self, name: str) -> tuple[int, ...]:
        """Shape that an array's header promises; it is borne out by the array's bytes.

        Raises
        ------
        NpzError, OSError
            As `array`.
        """
        return _guarded(lambda: self._opened(name, None))

    def array(self, name: str) -> NDArray:
        """Read an array.

        Raises
        ------
        NpzError
            There is none of that name, it is damaged, not numeric or larger than the limit.
        OSError
            It cannot be read.
        """
        array = _guarded(lambda: self._opened(name, self._left))
        self._left -= array.nbytes
        return array

    def _opened(self, name: str, most_bytes: int | None) -> Any:
        """Shape of an array, or with a limit the array."""
        info = self._members.get(name)
        if info is None:
            raise NpzError(f"it holds no {name}")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise NpzError(f"{name} is packed in a way that numpy does not")
        with self._archive.open(info) as member:
            start = member.read(10)
            if start[:6] != _MAGIC or start[6:7] not in (b"\1", b"\2", b"\3"):
                raise NpzError(f"{name} is no array")
            # Version 1 has two bytes of length, later ones four.
            length = start[8:10] if start[6:7] == b"\1" else start[8:10] + member.read(2)
            n_header = int.from_bytes(length, "little")
            found = _HEADER.fullmatch(member.read(n_header)) if n_header <= _LONGEST_HEADER else None
            if found is None:
                raise NpzError(f"{name} is no array of plain numbers")
            dtype = np.dtype(found[1].decode())
            shape = tuple(int(size) for size in found[3].split(b",") if size.strip())
            n_bytes = dtype.itemsize
            for size in shape:
                n_bytes *= size
            if info.file_size != 8 + len(length) + n_header + n_bytes:
                raise NpzError(f"{name} is not as long as it says")
            if most_bytes is None:
                return shape
            if n_bytes > most_bytes:
                raise NpzError(f"{name} is larger than {most_bytes:,} bytes")
            flat = np.empty(n_bytes // dtype.itemsize, dtype)
            _fill(member, flat.view(np.uint8), name, self._progress)
        return flat.reshape(shape, order="F" if found[2] == b"True" else "C")


def _fill(member: IO[bytes], data: NDArray[np.uint8], name: str, progress: Progress) -> None:
    done = 0
    while done < len(data):
        chunk = member.read(min(len(data) - done, 1 << 20))
        if not chunk:
            raise NpzError(f"{name} is cut short")
        data[done : done + len(chunk)] = np.frombuffer(chunk, np.uint8)
        done += len(chunk)
        progress(done / len(data))
    # The check sum is compared where the member ends.
    if member.read(1):
        raise NpzError(f"{name} is longer than it says")


def _guarded(call):
    """Run a call into the zip reader; what a damaged archive makes it raise becomes one kind of error."""
    try:
        return call()
    except (NpzError, OSError, Cancelled):
        raise
    # zipfile and zlib raise a dozen kinds, from struct.error to NotImplementedError, and each version its own.
    except Exception as error:
        raise NpzError(f"its bytes are damaged: {error}") from error
