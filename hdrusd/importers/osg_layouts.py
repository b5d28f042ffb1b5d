"""What a class of OpenSceneGraph writes into a binary file, field by field.

Fields have no names there: an object is the fields of its base classes and its own, in the
order of their serializers, which the tables ``osg_core_classes`` and ``osg_library_classes``
hold. A line of a table, which goes on where the next one is indented:

    LOD(Object Node Group) CenterMode:i UserCenter:?4d RangeList:?n{2f}

A base or field may hold in some versions of the format only: ``StateSet@-155``, ``NodeMask@142-``.
``?`` is a field behind a byte that says whether it is there, ``-`` one that nothing here reads and
that does not become part of the tree. Then, after a number that repeats it,

    b  c C  h H  i I  q Q  f d    boolean, integers of 1 to 8 bytes (signed first), floating point
    e(0=NAME/1=NAME)  g  v        enumeration, OpenGL's, value of a mode, 4 bytes each
    s  t  M  r                    text, text that may be missing, matrix, counted bytes
    o  O  X                       object; one that may be missing; such a one in brackets
    m  Y  Z                       the same for images
    a  A  p  V                    array that may be missing, array, primitive set and vertex data
                                  as they were before version 112
    [x,y]  n{x,y}  N{x,y}  {x,y}    counted values; in brackets; the same, without brackets if none;
                                  brackets alone
    =Word  Name:                  in the text form: a word, the begin of a line
    K  T                          animation channel, shown text
    !                             not known here

Sources: OpenSceneGraph 3.6, include/osgDB/Serializer, src/osgDB/ObjectWrapper.cpp.
"""

from __future__ import annotations

import re
from functools import cache
from typing import NamedTuple

from hdrusd.importers import osg_core_classes, osg_library_classes

_LATEST = 1 << 31
_VERTEX_DATA = (
    "{Array:a,Indices:a,Binding:e(0=BIND_OFF/1=BIND_OVERALL/2=BIND_PER_PRIMITIVE_SET/"
    "3=BIND_PER_PRIMITIVE/4=BIND_PER_VERTEX),Normalize:i}"
)
_HEAD = re.compile(r"([\w:]+)\(([^)]*)\)")
_FIELD = re.compile(r"(\w+)(?:@(\d*)-(\d*))?(?::(.*))?")
_TOKEN = re.compile(
    r"=(?P<word>\w+)|(?P<line>\w+):|(?P<open>[nN]?\{)|(?P<close>\})|e\((?P<names>[^)]*)\)"
    r"|\[(?P<vector>[^\]]*)\]|(?P<times>\d*)(?P<code>[a-zA-Z!])"
)

#: Codes of values of one size and NumPy's names of them, without the byte order.
_TYPES = "b=u1 c=i1 C=u1 h=i2 H=u2 i=i4 I=u4 q=i8 Q=u8 f=f4 d=f8 g=u4 v=i4 e=i4"
DTYPES = {code: dtype for code, _, dtype in (pair.partition("=") for pair in _TYPES.split())}


class Element(NamedTuple):
    """One part of a layout; ``code`` is its letter, or ``[``, ``{``, ``=``, ``:``."""

    code: str
    times: int = 1
    word: str = ""
    names: dict[int, str] | None = None
    inside: tuple[Element, ...] = ()

    @property
    def size(self) -> int | None:
        """Bytes; None where that is not the same for all."""
        dtype = DTYPES.get(self.code)
        return None if dtype is None else int(dtype[1]) * self.times


class Field(NamedTuple):
    """A field of a class in one version, or several that are passed over.

    ``absent``: how many fields from this one on are behind a byte that may be 0. ``skipped``:
    bytes of fields that nothing here reads. ``code``: of the layout where that has one element,
    ``-O`` for an object that nothing here reads.
    """

    name: str
    optional: bool
    layout: tuple[Element, ...]
    absent: int = 0
    skipped: int = 0
    code: str = ""


class Declared(NamedTuple):
    """A field or base and the versions that have it."""

    name: str
    first: int
    last: int
    layout: str


def plan(label: str, version: int, schema: dict[str, list[str]]) -> tuple[Field, ...] | None:
    """The fields of a class, those of its bases first; None for an unknown class.

    ``schema``: names of the fields that a class has, where the file itself says so.
    """
    found = _classes().get(label)
    if found is None:
        return None
    fields: list[Field] = []
    for base in (*found[0], Declared(label.removeprefix("osg::"), 0, _LATEST, "")):
        if not base.first <= version <= base.last:
            continue
        name = base.name if "::" in base.name else f"osg::{base.name}"
        own = _classes()[name][1]
        if name in schema:
            own = [field for word in schema[name] for field in own if field.name == word]
        fields += [_field(f) for f in own if f.first <= version <= f.last]
    return tuple(_joined(fields))


def _field(declared: Declared) -> Field:
    layout = _parse(declared.layout.lstrip("?-"))
    code = layout[0].code if len(layout) == 1 else ""
    unread = declared.layout.startswith("-")
    if unread and code != "O":
        return Field(declared.name, False, layout, skipped=sum(e.size or 0 for e in layout))
    optional = declared.layout.startswith("?")
    absent = int(optional or code == "O")
    return Field(declared.name, optional, layout, absent, code=f"-{code}" if unread else code)


def _joined(fields: list[Field]) -> list[Field]:
    """Fields to pass over as one, and the numbers of those in a row that may be absent."""
    made: list[Field] = []
    for field in reversed(fields):
        after = made[-1] if made else None
        if after is not None and field.skipped and after.skipped:
            made[-1] = field._replace(skipped=field.skipped + after.skipped)
        elif after is not None and field.absent:
            made.append(field._replace(absent=1 + after.absent))
        else:
            made.append(field)
    return made[::-1]


@cache
def _classes() -> dict[str, tuple[list[Declared], list[Declared]]]:
    """Names of classes to their bases and their own fields."""
    found = {}
    text = osg_core_classes.CLASSES + osg_library_classes.CLASSES
    for line in re.sub(r"\n +", lambda m: "" if text[m.start() - 1] == "/" else " ", text).split(
        "\n"
    ):
        head = _HEAD.match(line)
        if head is not None:
            label = head[1] if "::" in head[1] else f"osg::{head[1]}"
            found[label] = _declared(head[2]), _declared(line[head.end() :])
    return found


def _declared(words: str) -> list[Declared]:
    found = []
    for word in words.split():
        # a base may be of another library, and so have colons in its name
        name, layout = (word, "") if "::" in word else (word.partition(":")[0], word)
        parts = re.fullmatch(r"([\w:]+?)(?:@(\d*)-(\d*))?", name)
        assert parts is not None, word
        first, last = int(parts[2] or 0), int(parts[3] or _LATEST)
        found.append(Declared(parts[1], first, last, layout.partition(":")[2]))
    return found


@cache
def _parse(layout: str) -> tuple[Element, ...]:
    stack: list[tuple[str, list[Element]]] = [("", [])]
    for found in _TOKEN.finditer(layout):
        into = stack[-1][1]
        if found["open"]:
            stack.append((found["open"][0], []))
        elif found["close"]:
            code, inside = stack.pop()
            stack[-1][1].append(Element(code, inside=tuple(inside)))
        elif found["word"]:
            into.append(Element("=", word=found["word"]))
        elif found["line"]:
            into.append(Element(":", word=found["line"]))
        elif found["vector"]:
            into.append(Element("[", inside=_parse(found["vector"])))
        elif found["names"] is not None:
            pairs = (pair.split("=") for pair in found["names"].split("/"))
            into.append(Element("e", names={int(value): name for value, name in pairs}))
        elif found["code"] == "V":
            into += _parse(_VERTEX_DATA)
        else:
            into.append(Element(found["code"], int(found["times"] or 1)))
    return tuple(stack[0][1])
