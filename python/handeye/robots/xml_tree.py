"""XML from a stranger: read once, bounded in size and depth, with no document type and no entities.

Only elements, attributes and lines are kept. What needs a document type definition (entity bombs, files read
through external entities) is refused where it begins.
"""

from dataclasses import dataclass, field
from xml.parsers import expat

from handeye.codes import Code
from handeye.errors import InputError

MAX_BYTES = 16 << 20
MAX_DEPTH = 100
MAX_ELEMENTS = 100_000


@dataclass(frozen=True)
class Element:
    """An element, its attributes and what it contains."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list["Element"] = field(default_factory=list["Element"])

    def all(self, tag: str) -> list["Element"]:
        """Return the direct children of this name."""
        return [child for child in self.children if child.tag == tag]

    def one(self, tag: str) -> "Element | None":
        """Return the only direct child of this name, None if there is none.

        Raises
        ------
        InputError
            There are several.
        """
        found = self.all(tag)
        if len(found) > 1:
            raise InputError(f"line {found[1].line}: a second <{tag}> in <{self.tag}>", code=Code.INVALID_XML)
        return found[0] if found else None


def read_xml(content: bytes) -> Element:
    """Return the root element of an XML document.

    Raises
    ------
    InputError
        Larger than 16 MiB, nested deeper than 100, too many elements, a document type or an entity, or no
        well-formed XML; the message says where.
    """
    if len(content) > MAX_BYTES:
        raise InputError(f"{len(content)} bytes, expected at most {MAX_BYTES}", code=Code.TOO_LARGE)
    return _Reader().read(content)


class _Reader:
    """The state of one reading."""

    def __init__(self) -> None:
        self.parser = expat.ParserCreate()
        self.parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.StartDoctypeDeclHandler = self._refuse
        self.parser.EntityDeclHandler = self._refuse
        self.parser.ExternalEntityRefHandler = self._refuse
        self.open: list[Element] = []
        self.root: Element | None = None
        self.count = 0

    def read(self, content: bytes) -> Element:
        try:
            self.parser.Parse(content, True)
        except expat.ExpatError as error:
            raise InputError(
                f"line {error.lineno}: {expat.ErrorString(error.code)}",
                code=Code.INVALID_XML,
                hint="the file is not well-formed XML; was it cut off or edited by hand?",
            ) from error
        except (ValueError, LookupError) as error:  # an encoding that expat or Python does not know
            raise InputError(f"not readable as XML ({error})", code=Code.INVALID_XML) from error
        if self.root is None:
            raise InputError("no XML element", code=Code.INVALID_XML)
        return self.root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        line = self.parser.CurrentLineNumber
        if len(self.open) >= MAX_DEPTH or self.count > MAX_ELEMENTS:
            raise InputError(
                f"line {line}: nested deeper than {MAX_DEPTH}, or more than {MAX_ELEMENTS} elements",
                code=Code.TOO_LARGE,
            )
        element = Element(tag, attributes, line)
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element
        self.open.append(element)

    def _end(self, _tag: str) -> None:
        self.open.pop()

    def _refuse(self, *_details: object) -> int:
        raise InputError(
            f"line {self.parser.CurrentLineNumber}: a document type or an entity",
            code=Code.UNSAFE_XML,
            hint="a robot description needs none: remove <!DOCTYPE ...> and what refers to it",
        )
