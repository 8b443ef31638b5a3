"""Headers of PCD and PLY files, read to refuse a lying point count before a library allocates for it."""

from __future__ import annotations

from ..errors import ScanFormatError

HEADER_LIMIT_BYTES = 65536
DEFAULT_MAX_POINTS = 50_000_000

_PLY_SIZES = {
    "char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2, "uint16": 2, "int": 4,
    "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4, "double": 8, "float64": 8,
}  # fmt: skip


def check_cloud_header(head: bytes, file_bytes: int, suffix: str, source: str, max_points: int) -> None:
    """Refuse (ScanFormatError) a PCD or PLY whose header is not one, or claims more points than its bytes can hold."""
    count, least_bytes = _pcd_claim(head, source) if suffix == ".pcd" else _ply_claim(head, source)
    if count <= 0:
        raise ScanFormatError(f"{source}: its header claims {count} points")
    if count > max_points:
        raise ScanFormatError(f"{source}: its header claims {count} points, the limit is {max_points}")
    if least_bytes > file_bytes:
        raise ScanFormatError(
            f"{source}: its header claims {count} points, at least {least_bytes} bytes; the file has {file_bytes}"
        )


def _header_lines(head: bytes) -> list[list[str]]:
    return [line.split() for line in head.decode("latin-1").splitlines()]


def _pcd_claim(head: bytes, source: str) -> tuple[int, int]:
    """Claimed points of a PCD and the fewest bytes that hold so many."""
    fields: dict[str, list[str]] = {}
    for words in _header_lines(head):
        if words and not words[0].startswith("#"):
            fields[words[0].upper()] = words[1:]
            if words[0].upper() == "DATA":
                break
    try:
        count = int(fields["POINTS"][0])
        sizes = [int(size) for size in fields["SIZE"]]
        counts = [int(number) for number in fields.get("COUNT", ["1"] * len(sizes))]
        encoding = fields["DATA"][0].lower()
        names = fields["FIELDS"]
    except (KeyError, IndexError, ValueError) as error:
        raise ScanFormatError(f"{source}: not a PCD header ({error})") from error
    if not {"x", "y", "z"} <= set(names):
        raise ScanFormatError(f"{source}: a PCD without the fields x y z")
    row_bytes = sum(size * number for size, number in zip(sizes, counts, strict=False))
    if encoding == "binary":
        return count, count * row_bytes
    # Text takes a digit and a separator per value; LZF spends 3 bytes on at most 264.
    return count, count * 2 * len(sizes) if encoding == "ascii" else count * row_bytes // 100


def _ply_claim(head: bytes, source: str) -> tuple[int, int]:
    """Claimed vertices of a PLY and the fewest bytes that hold so many."""
    lines = _header_lines(head)
    if not lines or lines[0] != ["ply"]:
        raise ScanFormatError(f"{source}: not a PLY header")
    count, ascii_text, element, row_bytes, names = -1, False, "", 0, set[str]()
    for words in lines[1:]:
        if words[:1] == ["end_header"]:
            break
        if words[:1] == ["format"]:
            ascii_text = words[1:2] == ["ascii"]
        elif words[:1] == ["element"] and len(words) == 3:
            element = words[1]
            if element == "vertex":
                count = int(words[2]) if words[2].isdigit() else -1
        elif words[:1] == ["property"] and element == "vertex" and len(words) == 3:
            row_bytes += 2 if ascii_text else _PLY_SIZES.get(words[1], 1)
            names.add(words[2])
    if not {"x", "y", "z"} <= names:
        raise ScanFormatError(f"{source}: a PLY without vertices of x y z")
    return count, count * row_bytes
