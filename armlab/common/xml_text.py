"""XML documents that keep their text: what is not changed is written as it was read, comments and spaces included."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from armlab.common.errors import InputError

MAX_BYTES = 10_000_000
MAX_DEPTH = 200  # of elements inside each other
INDENT = "  "
ROUNDING = 1e-14  # of the largest of several numbers
_HEAD = re.compile(rb"<[^\s/>]+(?:\s+[^\s=]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*\s*/?>")
_COMMENT = re.compile(rb"<!--(.*?)-->", re.DOTALL)
_TAIL = re.compile(rb"</[^>]*>")
_ATTRIBUTE = re.compile(r"\s+([^\s=]+)\s*=\s*(?:\"[^\"]*\"|'[^']*')")
_DECLARED = re.compile(rb"<\?xml[^>]*?\sencoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']")


@dataclass(eq=False)
class XmlNode:
    """An element of a text.

    head, tail: its tags as they are written; the tail is empty where the head ends with `/>`. pieces: what stands
    between, texts and elements. line: of the head in its file, from 1. indent: the spaces before the head where it
    begins a line, else None.
    """

    tag: str
    head: str
    attributes: dict[str, str]
    line: int = 0
    indent: str | None = None
    pieces: list["str | XmlNode"] = field(default_factory=list)
    tail: str = ""

    @property
    def children(self) -> list["XmlNode"]:
        """The elements inside, in order."""
        return [piece for piece in self.pieces if isinstance(piece, XmlNode)]

    def find(self, tag: str) -> "XmlNode | None":
        """The first element inside with a tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator["XmlNode"]:
        """The element and all that are inside, in the order of the text."""
        yield self
        for child in self.children:
            yield from child.walk()

    def text(self) -> str:
        """The element as it is written."""
        return self.head + "".join(p if isinstance(p, str) else p.text() for p in self.pieces) + self.tail

    def set(self, attributes: Mapping[str, str | None]) -> None:
        """Changes attributes, adds those that are new, and removes those that are None; the others stay as written."""
        waiting = dict(attributes)

        def changed(found: re.Match[str]) -> str:
            if found[1] not in attributes:
                return found[0]
            value = waiting.pop(found[1], None)
            space = found[0][: len(found[0]) - len(found[0].lstrip())]
            return "" if value is None else f"{space}{found[1]}={quoteattr(value)}"

        name = re.match(r"<[^\s/>]+", self.head)
        assert name is not None
        rest = _ATTRIBUTE.sub(changed, self.head[name.end() :])
        end = re.search(r"\s*/?>$", rest)
        assert end is not None
        added = "".join(f" {key}={quoteattr(value)}" for key, value in waiting.items() if value is not None)
        self.head = name[0] + rest[: end.start()] + added + rest[end.start() :]
        kept = {**self.attributes, **attributes}
        self.attributes = {key: value for key, value in kept.items() if value is not None}

    def rename(self, tag: str) -> None:
        """Gives the element another tag; its attributes stay."""
        self.head = f"<{tag}{self.head[len(self.tag) + 1 :]}"
        self.tail = f"</{tag}>" if self.tail else ""
        self.tag = tag

    def set_numbers(self, attributes: Mapping[str, str | None]) -> None:
        """Changes attributes of numbers as `set`; those that differ by rounding alone stay as written."""
        self.set({key: value for key, value in attributes.items() if not _is_rounding(self.attributes.get(key), value)})

    def add(self, tag: str, attributes: Mapping[str, str], first: bool = False) -> "XmlNode":
        """A new element inside, after the others or before them, on a line of its own where the others have one."""
        if self.head.endswith("/>"):
            self.head, self.tail = self.head[:-2].rstrip() + ">", f"</{self.tag}>"
        others = self.children
        indent = others[0].indent if others else None if self.indent is None else self.indent + INDENT
        head = f"<{tag}{''.join(f' {key}={quoteattr(value)}' for key, value in attributes.items())}/>"
        node = XmlNode(tag, head, dict(attributes), indent=indent)
        lead = [] if indent is None else [f"\n{indent}"]
        if others:
            place = self.pieces.index(others[0]) if first else self.pieces.index(others[-1]) + 1
            self.pieces[place:place] = [node, *lead] if first else [*lead, node]
        else:
            end = [] if self.indent is None else [f"\n{self.indent}"]
            kept = [piece for piece in self.pieces if isinstance(piece, str) and piece.strip()]
            self.pieces = [*kept, *lead, node, *end]
        return node

    def remove(self, child: "XmlNode") -> None:
        """Takes an element out, with the spaces before it."""
        place = self.pieces.index(child)
        del self.pieces[place]
        before = self.pieces[place - 1] if place else None
        if isinstance(before, str):
            self.pieces[place - 1] = before.rstrip()


def _is_rounding(one: str | None, other: str | None) -> bool:
    """Whether two texts hold the same numbers, but for the last digits."""
    try:
        numbers, others = ([float(word) for word in (text or "").split()] for text in (one, other))
    except ValueError:
        return False
    size = max(map(abs, [*numbers, *others]), default=0.0)
    alike = len(numbers) == len(others) > 0
    return alike and all(abs(a - b) <= ROUNDING * size for a, b in zip(numbers, others, strict=True))


@dataclass(eq=False)
class XmlText:
    """A document: its outermost element, and the texts before and after it."""

    root: XmlNode
    before: str = ""
    after: str = ""

    def text(self) -> str:
        """The whole, for a file in UTF-8."""
        return self.before + self.root.text() + self.after


def read_xml_text(path: Path) -> XmlText:
    """The document of a file; InputError, in one line, where it cannot be read or is no XML."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    return parse_xml_text(_in_utf8(content, path), str(path))


def parse_xml_text(text: str, where: str) -> XmlText:
    """The document of a text; where: its file, for messages. Raises InputError, in one line, for what is no XML."""
    content = text.encode()
    if len(content) > MAX_BYTES or b"<!ENTITY" in content:
        raise InputError(f"{where}: too large, or with XML entities, for a robot file")
    reader = _Reader(content, where)
    try:
        reader.parser.Parse(_COMMENT.sub(_without_hyphens, content), True)
    except expat.ExpatError as error:
        raise InputError(f"{where} is not valid XML: {error}") from None
    root = reader.top.children[0]
    place = reader.top.pieces.index(root)
    before, after = ("".join(map(str, part)) for part in (reader.top.pieces[:place], reader.top.pieces[place + 1 :]))
    return XmlText(root, before, after + content[reader.position :].decode())


def _without_hyphens(comment: re.Match[bytes]) -> bytes:
    """A comment of the same length: MuJoCo takes two hyphens in a row there, which XML does not have."""
    return b"<!--" + comment[1].replace(b"-", b"=") + b"-->"


def _in_utf8(content: bytes, path: Path) -> str:
    """The text of a file, its declaration without an encoding where that is another one than UTF-8."""
    declared = _DECLARED.match(content)
    encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else declared[1].decode() if declared else "utf-8"
    try:
        text = content.decode("utf-8-sig" if encoding.lower() == "utf-8" else encoding)
    except (UnicodeError, LookupError):
        raise InputError(f"{path} is not text in {encoding}") from None
    return re.sub(r"(<\?xml[^>]*?)\sencoding\s*=\s*[\"'][^\"']*[\"']", r"\1", text, count=1)


class _Reader:
    """Builds nodes from the events of a parser; `top` holds the outermost element."""

    def __init__(self, content: bytes, where: str) -> None:
        self.content, self.where, self.position = content, where, 0
        self.top = XmlNode("", "", {})
        self.open = [self.top]
        self.parser = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self.open) > MAX_DEPTH:
            raise InputError(f"{self.where}: more than {MAX_DEPTH} elements inside each other")
        place = self.parser.CurrentByteIndex
        self._keep_until(place)
        head = _HEAD.match(self.content, place)
        assert head is not None
        line_start = self.content.rfind(b"\n", 0, place) + 1
        lead = self.content[line_start:place].decode()
        indent = lead if line_start and not lead.strip() else None
        node = XmlNode(tag, head[0].decode(), attributes, self.parser.CurrentLineNumber, indent)
        self.open[-1].pieces.append(node)
        self.open.append(node)
        self.position = head.end()

    def end(self, tag: str) -> None:
        node = self.open[-1]
        if not node.head.endswith("/>"):
            self._close(node)
        self.open.pop()

    def _close(self, node: XmlNode) -> None:
        self._keep_until(self.parser.CurrentByteIndex)
        tail = _TAIL.match(self.content, self.position)
        assert tail is not None
        node.tail, self.position = tail[0].decode(), tail.end()

    def _keep_until(self, place: int) -> None:
        if place > self.position:
            self.open[-1].pieces.append(self.content[self.position : place].decode())
        self.position = place
