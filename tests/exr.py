"""Reads what Blender writes as uncompressed multilayer OpenEXR; no package that does is in every Blender."""
import struct

import numpy as np

DTYPES = {0: "<u4", 1: "<f2", 2: "<f4"}
MULTIPART = 0x1000


def read(path):
    """{"Layer.Pass.Channel": (height, width) array}, row 0 at the bottom; uncompressed scanlines only."""
    data = path.read_bytes()
    magic, version = struct.unpack_from("<2I", data)
    assert magic == 20000630
    at, headers = 8, []
    while data[at]:
        header, at = _header(data, at)
        headers.append(header)
        if not version & MULTIPART:
            break
    else:
        at += 1
    out = {}
    for header in headers:
        x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
        width, height = x1 - x0 + 1, y1 - y0 + 1
        prefix = header["name"].decode() + "." if "name" in header else ""
        channels = _channels(header["channels"])
        row = np.dtype([(name, kind, (width,)) for name, kind in channels])
        images = [np.empty((height, width), kind) for _, kind in channels]
        for offset in struct.unpack_from(f"<{height}Q", data, at):
            offset += 4 if version & MULTIPART else 0  # the part's number
            y = struct.unpack_from("<i", data, offset)[0] - y0
            line = np.frombuffer(data, row, 1, offset + 8)[0]
            for image, (name, _) in zip(images, channels):
                image[height - 1 - y] = line[name]
        at += 8 * height
        out |= {name if name.startswith(prefix) else prefix + name: image for (name, _), image in zip(channels, images)}
    return out


def _header(data, at):
    attributes = {}
    while data[at]:
        name, kind, _ = data[at : at + 600].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        (size,) = struct.unpack_from("<i", data, at)
        attributes[name.decode()] = data[at + 4 : at + 4 + size]
        at += 4 + size
    assert attributes["compression"] == b"\0", "write it with exr_codec NONE"
    return attributes, at + 1


def _channels(listed):
    channels = []
    while listed[0]:
        name, rest = listed.split(b"\0", 1)
        channels.append((name.decode(), DTYPES[struct.unpack_from("<i", rest)[0]]))
        listed = rest[16:]
    return channels
