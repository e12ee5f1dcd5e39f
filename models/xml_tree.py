"""XML elements that know their line, read within stated bounds."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.parsers import expat

from .errors import ModelError

MAX_BYTES = 4 << 20
MAX_ELEMENTS = 20_000
MAX_DEPTH = 16
MAX_ATTRIBUTES = 32
SHOWN = 40
"""Characters of a text that a message repeats."""


@dataclass(slots=True)
class Element:
    """An XML element.

    Attributes:
        tag: as written, with its prefix.
        attributes: as written; numbers are read by the linter.
        line: where it starts.
        text: the beginning of what stands between its children besides white space.
        numbers: values of the attributes that are numbers.
        children: in their order.
        sound: whether it was read, and nothing was found in it that a grammar refuses.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    text: str = ""
    numbers: dict[str, tuple[float, ...]] = field(default_factory=dict)
    children: list[Element] = field(default_factory=list)
    sound: bool = False

    def child(self, tag: str) -> Element | None:
        """First child of that tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def need(self, tag: str) -> Element:
        """The child of that tag, which the grammar demands."""
        return next(child for child in self.children if child.tag == tag)

    def all(self, tag: str) -> list[Element]:
        """All children of that tag."""
        return [child for child in self.children if child.tag == tag]

    def content(self) -> tuple[object, ...]:
        """Everything but the lines: equal for elements that say the same."""
        children = tuple(child.content() for child in self.children)
        return self.tag, tuple(sorted(self.attributes.items())), self.text, children


def parse(text: str, source: str) -> Element:
    """Root element of an XML text.

    Raises:
        ModelError: for malformed XML, a document type (entities can explode), an encoding other than UTF-8,
            or more than MAX_BYTES, MAX_ELEMENTS, MAX_DEPTH levels or MAX_ATTRIBUTES an element.
    """
    top, count = Element("", {}, 0), 0
    stack = [top]

    def refuse(problem: str, fix: str) -> None:
        raise ModelError(source, parser.CurrentLineNumber, problem, fix)

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MAX_ELEMENTS:
            refuse(f"more than {MAX_ELEMENTS} elements", "describe the machine with fewer")
        if len(stack) > MAX_DEPTH:
            refuse(f"elements nested more than {MAX_DEPTH} deep", "a URDF needs a handful of levels")
        if len(attributes) > MAX_ATTRIBUTES:
            refuse(f"an element with {len(attributes)} attributes", f"at most {MAX_ATTRIBUTES}")
        element = Element(tag, attributes, parser.CurrentLineNumber)
        stack[-1].children.append(element)
        stack.append(element)

    def end(_: str) -> None:
        stack.pop()

    def characters(data: str) -> None:
        element = stack[-1]
        if len(element.text) < SHOWN:
            element.text += data.strip()[:SHOWN]

    def declaration(_: str, encoding: str | None, __: int) -> None:
        if encoding is not None and encoding.upper() not in ("UTF-8", "US-ASCII"):
            refuse(f"declares the encoding {encoding[:20]}", "save it as UTF-8")

    size = len(text.encode("utf-8", "surrogatepass"))
    if size > MAX_BYTES:
        raise ModelError(source, 0, f"{size} bytes of XML", f"keep the description below {MAX_BYTES} bytes")
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    parser.XmlDeclHandler = declaration
    parser.StartDoctypeDeclHandler = lambda *_: refuse("a document type declaration", "remove <!DOCTYPE ...>")
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ModelError(
            source, error.lineno, f"not XML: {expat.ErrorString(error.code)}", "mend the file"
        ) from error
    except UnicodeEncodeError as error:
        raise ModelError(source, 0, "holds half a character (a surrogate)", "save it as UTF-8") from error
    return top.children[0]
