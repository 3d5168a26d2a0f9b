"""What the shipped tests of a family ask."""


def rules_of(family: type) -> set[str]:
    """Names of its tests."""
    return {name for name in vars(family) if name.startswith("test_")}
