"""The limited archive reader: numpy's arrays come out, and nothing else does any harm."""

import io
import zipfile

import numpy as np
import pytest

from splap_editor.io.npz import NpzError, NpzFile


def archive(members: dict[str, bytes], method: int = zipfile.ZIP_STORED) -> io.BytesIO:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", method) as file:
        for name, held in members.items():
            file.writestr(name, held)
    return data


def member(array, header: bytes | None = None) -> bytes:
    data = io.BytesIO()
    np.save(data, array)
    whole = data.getvalue()
    if header is None:
        return whole
    start = 10 + int.from_bytes(whole[8:10], "little")
    return whole[:8] + len(header).to_bytes(2, "little") + header + whole[start:]


@pytest.mark.parametrize("write", [np.savez, np.savez_compressed])
def test_reads_what_numpy_writes(write):
    arrays = {
        "a": np.arange(5, dtype=">i2"),
        "b": np.array(0.5),
        "c": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        "d": np.zeros((0, 3)),
        "e": np.ones((2, 3, 4), bool),
    }
    data = io.BytesIO(b"sixteen bytes...")
    data.seek(0, io.SEEK_END)
    write(data, **arrays)
    file = NpzFile(data, 1 << 20)
    assert file.names == tuple(arrays)
    for name, array in arrays.items():
        assert file.shape(name) == array.shape
        np.testing.assert_array_equal(file.array(name), array)
        assert file.array(name).dtype == array.dtype


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (io.BytesIO(b""), "damaged"),
        (io.BytesIO(b"PK" + bytes(500)), "damaged"),
        (archive({"b.npy": member(np.zeros(1))}), "it holds no a"),
        (archive({"a.npy": b"text, not an array"}), "a is no array"),
        (archive({"a.npy": member(np.zeros(4))[:-1]}), "not as long as it says"),
        (archive({"a.npy": member(np.zeros(4)) + b"x"}), "not as long as it says"),
        (archive({"a.npy": member(np.array([{}], object))}), "no array of plain numbers"),
        (archive({"a.npy": member(np.zeros(2, [("x", "f4")]))}), "no array of plain numbers"),
        (archive({"a.npy": member(np.zeros(2), b"__import__('os')\n")}), "no array of plain numbers"),
        (archive({"a.npy": member(np.zeros(2), b"{'descr': '<f8', 'fortran_order': Fal\n")}), "no array of plain"),
        (archive({"a.npy": member(np.zeros(2), b"(" * 3000 + b"\n")}), "no array of plain numbers"),
        (
            archive({"a.npy": member(np.zeros(2), b"{'descr': '<f8', 'fortran_order': False, 'shape': (10**9,), }\n")}),
            "no array of plain numbers",
        ),
        (
            archive(
                {
                    "a.npy": member(
                        np.zeros(2), b"{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999, 99999999), }\n"
                    )
                }
            ),
            "not as long as it says",
        ),
        (archive({"a.npy": member(np.zeros(1 << 18))}, zipfile.ZIP_DEFLATED), "larger than"),
        (archive({"a.npy": member(np.zeros(4))}, zipfile.ZIP_LZMA), "packed in a way"),
        (archive({"a.npy": member(np.zeros(4))}, zipfile.ZIP_BZIP2), "packed in a way"),
        (archive({f"{k}.npy": b"" for k in range(300)}), "members"),
        (archive({"a": member(np.zeros(1)), "a.npy": member(np.zeros(1))}), "same name"),
    ],
)
def test_refuses_what_is_no_archive_of_plain_arrays(data, said):
    with pytest.raises(NpzError, match=said):
        NpzFile(data, 1 << 20).array("a")


@pytest.mark.parametrize("write", [np.savez, np.savez_compressed])
def test_no_flipped_bit_escapes_as_another_error(write):
    data = io.BytesIO()
    write(data, a=np.arange(30.0), b=np.arange(3))
    held = data.getvalue()
    n_refused = 0
    for at in range(len(held)):
        for bit in (1, 0x20, 0x80):
            broken = held[:at] + bytes([held[at] ^ bit]) + held[at + 1 :]
            try:
                file = NpzFile(io.BytesIO(broken), 1 << 20)
                for name in file.names:
                    file.array(name)
            except (NpzError, OSError):
                n_refused += 1
    # The arrays' bytes are guarded by their checksum; not each byte of the folders about them is read.
    assert n_refused > len(held)
