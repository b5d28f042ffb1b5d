"""Data sources of COLLADA: an array and the accessor that says how it is cut.

COLLADA 1.4.1, chapter 5, ``source`` and ``accessor``. Counts are not believed: as many rows
come back as the array has numbers for.
"""

from __future__ import annotations

from hdrusd.importers.collada_document import Document, Doubles
from hdrusd.importers.collada_xml import Element
from hdrusd.report import Kind

_ARRAYS = ("float_array", "int_array")
_NAMES = ("Name_array", "IDREF_array", "SIDREF_array")


class Sources:
    """Reads sources; each once, as they are shared."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._tables: dict[int, Doubles] = {}
        self._arrays: dict[int, Doubles] = {}

    def table(self, source: Element) -> Doubles:
        """(rows, width) float64 of a source; a column for each named param, or for all.

        Raises InputError where there is no array or the accessor makes no sense.
        """
        if id(source) not in self._tables:
            self._tables[id(source)] = self._table(source)
        return self._tables[id(source)]

    def names(self, source: Element) -> list[str]:
        """The words of a source of names; nothing where it has none."""
        array = source.child(*_NAMES)
        return [] if array is None else array.text.split()

    def _table(self, source: Element) -> Doubles:
        document = self._document
        accessor = source.path("technique_common", "accessor")
        array = source.child(*_ARRAYS)
        if accessor is not None and accessor.get("source"):
            # an accessor may look into another source's array
            name = accessor.get("source").partition("#")[2]
            found = document.ids.get(name)
            if found is not None and found.tag in _ARRAYS:
                array = found
        if array is None:
            raise document.error(source, f"source {source.get('id')[:80]!r} has no numbers")
        values = self._array(array)
        if accessor is None:
            width = 3 if len(values) % 3 == 0 else 1
            text = f"no accessor; read as rows of {width}"
            document.note(Kind.ASSUMED, "collada-source", source, source.get("id"), text)
            return values.reshape(-1, width)
        stride = _whole(accessor.get("stride"), 1)
        offset = _whole(accessor.get("offset"), 0)
        if stride < 1 or offset < 0 or stride > max(len(values), 1):
            text = f"stride {stride}, offset {offset} in an array of {len(values)}; not used"
            raise document.error(accessor, text)
        columns = _columns(accessor, stride)
        rows = max(len(values) - offset, 0) // stride
        declared = _whole(accessor.get("count"), rows)
        if declared != rows and (declared > rows or offset == 0):
            text = f"accessor counts {declared} rows of {stride}, the array has {rows}"
            document.note(Kind.INVALID, "collada-count", accessor, source.get("id"), text)
        cut = values[offset : offset + rows * stride].reshape(rows, stride)
        return cut if columns == list(range(stride)) else cut[:, columns]

    def _array(self, array: Element) -> Doubles:
        if id(array) not in self._arrays:
            values = self._document.numbers(array)
            declared = _whole(array.get("count"), len(values))
            if declared != len(values):
                text = f"array counts {declared} numbers and has {len(values)}; those are used"
                self._document.note(Kind.INVALID, "collada-count", array, array.get("id"), text)
            self._arrays[id(array)] = values
        return self._arrays[id(array)]


def _columns(accessor: Element, stride: int) -> list[int]:
    """The numbers of a row that a param with a name stands for; all where params are wider."""
    params = list(accessor.all("param"))
    if len(params) != stride:  # one float4x4 is 16 numbers
        return list(range(stride))
    return [n for n, param in enumerate(params) if param.get("name")] or list(range(stride))


def _whole(word: str, default: int) -> int:
    word = word.strip()
    return int(word) if word.isdecimal() and len(word) < 19 else default
