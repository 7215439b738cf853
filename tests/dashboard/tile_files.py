"""A picture tile of one colour, and a PMTiles file (specification version 3) with it for the whole world at zoom 0."""

import gzip
import struct
import zlib

PNG_TYPE, GZIP, NO_COMPRESSION = 2, 2, 1
SIDE = 256


def png(rgb: tuple[int, int, int]) -> bytes:
    """256 x 256, one colour."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    rows = (b"\x00" + bytes(rgb) * SIDE) * SIDE
    head = struct.pack(">IIBBBBB", SIDE, SIDE, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def pmtiles(tile: bytes) -> bytes:
    """Header, root directory of one entry (section 4.2: columns of varints), empty metadata, the tile."""
    entry = b"\x01" + b"\x00" + b"\x01" + _varint(len(tile)) + b"\x01"  # count; id, run length, length, offset + 1
    root, metadata = gzip.compress(entry), gzip.compress(b"{}")
    root_at = 127
    metadata_at = root_at + len(root)
    data_at = metadata_at + len(metadata)
    places = (root_at, len(root), metadata_at, len(metadata), 0, 0, data_at, len(tile), 1, 1, 1)
    kinds = (1, GZIP, NO_COMPRESSION, PNG_TYPE, 0, 0)  # clustered, directories, tiles, type, least and greatest zoom
    bounds = (-1_800_000_000, -850_000_000, 1_800_000_000, 850_000_000)
    header = b"PMTiles\x03" + struct.pack("<11Q6B4iB2i", *places, *kinds, *bounds, 0, 0, 0)
    assert len(header) == root_at
    return header + root + metadata + tile


def _varint(value: int) -> bytes:
    parts = bytearray()
    while value >= 0x80:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(parts) + bytes([value])
