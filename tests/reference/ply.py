"""PLY files made plainly, to read back: any format, order and type, and SuperSplat's compressed form."""

import numpy as np

TYPE_WORDS = {"f4": "float", "f8": "double", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint"}
BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}


def splat_columns(n, rng, *, n_scales=3, n_rest=0, normals=False, rgb=False):
    """Columns of random splats with the common names, float32."""
    columns = dict(zip("xyz", rng.normal(size=(3, n)), strict=True))
    if normals:
        columns |= {name: np.zeros(n) for name in ("nx", "ny", "nz")}
    if rgb:
        columns |= {name: rng.integers(0, 256, n).astype("u1") for name in ("red", "green", "blue")}
    else:
        columns |= {f"f_dc_{i}": rng.normal(size=n) for i in range(3)}
    columns |= {f"f_rest_{i}": rng.normal(size=n) for i in range(n_rest)}
    columns["opacity"] = 4 * rng.normal(size=n)
    columns |= {f"scale_{i}": rng.normal(size=n) - 4 for i in range(n_scales)}
    columns |= {f"rot_{i}": rng.normal(size=n) for i in range(4)}
    return {name: values if values.dtype == "u1" else values.astype("f4") for name, values in columns.items()}


def element_bytes(name, columns, format_, newline=b"\n"):
    """Header lines and body of one element; a column that is a list of arrays is a PLY list."""
    n = len(next(iter(columns.values())))
    lines = [f"element {name} {n}".encode()]
    for column, values in columns.items():
        if isinstance(values, list):
            lines.append(f"property list uchar {TYPE_WORDS[values[0].dtype.str[1:]]} {column}".encode())
        else:
            lines.append(f"property {TYPE_WORDS[values.dtype.str[1:]]} {column}".encode())
    order = BYTE_ORDERS[format_]
    rows = []
    for i in range(n):
        words, data = [], b""
        for values in columns.values():
            if isinstance(values, list):
                words += [str(len(values[i])), *(str(v) for v in values[i])]
                data += bytes([len(values[i])]) + values[i].astype(values[i].dtype.newbyteorder(order)).tobytes()
            else:
                words.append(str(values[i]))
                data += values[i : i + 1].astype(values.dtype.newbyteorder(order)).tobytes()
        rows.append(" ".join(words).encode() + newline if format_ == "ascii" else data)
    return lines, b"".join(rows)


def ply_bytes(columns, format_="binary_little_endian", *, comments=(), newline=b"\n", before=None, after=None):
    """A whole PLY file: elements ``before`` and ``after`` (name → columns) around the vertices."""
    lines = [b"ply", f"format {format_} 1.0".encode(), *(f"comment {text}".encode() for text in comments)]
    body = b""
    for name, held in {**(before or {}), "vertex": columns, **(after or {})}.items():
        more, data = element_bytes(name, held, format_, newline)
        lines += more
        body += data
    return newline.join([*lines, b"end_header"]) + newline + body


def compressed_bytes(columns):
    """Encode float columns as SuperSplat does, in the given order (it sorts by Morton code first).

    Follows the description of the format splat by splat: 256 to a chunk, 11-10-11 bits for positions and
    log-scales, 8 bits for colour and opacity, the three smallest quaternion components in 10 bits each.
    """
    n = len(columns["x"])
    scales = [np.clip(columns[f"scale_{i}"], -20, 20) for i in range(3)]
    colours = [columns[f"f_dc_{i}"] * 0.28209479177387814 + 0.5 for i in range(3)]
    bounded = [*(columns[c] for c in "xyz"), *scales, *colours]
    names = ["x", "y", "z", "scale_x", "scale_y", "scale_z", "r", "g", "b"]
    n_chunks = -(-n // 256)
    chunk = {}
    for group in (names[0:3], names[3:6], names[6:9]):
        for end, pick in (("min", np.min), ("max", np.max)):
            for name in group:
                values = bounded[names.index(name)]
                chunk[f"{end}_{name}"] = np.array(
                    [pick(values[c * 256 : c * 256 + 256]) for c in range(n_chunks)], "f4"
                )
    packed = {f"packed_{part}": np.zeros(n, "u4") for part in ("position", "rotation", "scale", "color")}
    for i in range(n):
        share = []
        for name, values in zip(names, bounded, strict=True):
            low, high = float(chunk[f"min_{name}"][i // 256]), float(chunk[f"max_{name}"][i // 256])
            share.append(0.0 if high == low else min(max((float(values[i]) - low) / (high - low), 0), 1))
        packed["packed_position"][i] = _bits(share[0:3], (11, 10, 11))
        packed["packed_scale"][i] = _bits(share[3:6], (11, 10, 11))
        alpha = 1 / (1 + np.exp(-float(columns["opacity"][i])))
        packed["packed_color"][i] = _bits([*share[6:9], alpha], (8, 8, 8, 8))
        quat = np.array([float(columns[f"rot_{c}"][i]) for c in range(4)])
        quat /= np.linalg.norm(quat)
        largest = int(np.argmax(np.abs(quat)))
        quat *= np.sign(quat[largest])
        three = [quat[c] * np.sqrt(2) / 2 + 0.5 for c in range(4) if c != largest]
        packed["packed_rotation"][i] = largest << 30 | _bits(three, (10, 10, 10))
    n_rest = sum(name.startswith("f_rest_") for name in columns)
    harmonics = {}
    for c in range(n_rest):
        coded = np.trunc((columns[f"f_rest_{c}"] / 8 + 0.5) * 256)
        harmonics[f"f_rest_{c}"] = np.clip(coded, 0, 255).astype("u1")
    after = {"sh": harmonics} if n_rest else None
    return ply_bytes(packed, before={"chunk": chunk}, after=after, comments=["Generated by SuperSplat 2.7.1"])


def _bits(shares, sizes):
    """Numbers in [0, 1] as bit fields, first one highest."""
    word = 0
    for share, size in zip(shares, sizes, strict=True):
        word = word << size | int(np.floor(share * (2**size - 1) + 0.5))
    return word
