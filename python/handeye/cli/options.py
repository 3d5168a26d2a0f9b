"""Options that every command has."""

from dataclasses import dataclass
from typing import Annotated

from cyclopts import Parameter, validators

# Random numbers are drawn from whole numbers from zero on.
Seed = Annotated[int, Parameter(validator=validators.Number(gte=0, lt=2**63))]


@Parameter(name="*", group="Common")
@dataclass(frozen=True)
class Common:
    """Options of every command; the boundary obeys them, so commands only pass them on."""

    json: Annotated[bool, Parameter(show_default=False)] = False
    """Print one JSON object instead of text."""
    debug: Annotated[bool, Parameter(show_default=False)] = False
    """Show where an error arose."""
