"""URDF, and the same as a macro of xacro with a prefix for its names."""

import re

from handeye.robots.corrected import urdf_of
from handeye.robots.formats.base import ArmFormat, CorrectedArm


def _urdf(arm: CorrectedArm) -> str:
    return urdf_of(arm.built, arm.notes)


def _xacro(arm: CorrectedArm) -> str:
    """A macro `corrected_arm` with a parameter `prefix`; the file also uses it once, without a prefix."""
    text = urdf_of(arm.built)
    body = text[text.index(">", text.index("<robot")) + 1 : text.rindex("</robot>")]
    # What was a dollar sign in a name stays one.
    body = body.replace("${", "$${")
    body = re.sub(r'(<(?:link|joint) name="|<(?:parent|child) link=")', r"\1${prefix}", body)
    name = text[text.index('name="', text.index("<robot")) :].split('"')[1].replace("${", "$${")
    notes = "".join(f"<!-- {note.replace('--', '- -')} -->\n" for note in arm.notes)
    indented = "\n".join(f"  {line}" if line else line for line in body.rstrip().split("\n"))
    return (
        f'<?xml version="1.0"?>\n{notes}<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="{name}">\n'
        f'  <xacro:macro name="corrected_arm" params="prefix">{indented}\n  </xacro:macro>\n'
        '  <xacro:corrected_arm prefix=""/>\n</robot>\n'
    )


FORMATS = (
    ArmFormat("urdf", "URDF: joints, without shapes and masses", whole=True, text=_urdf),
    ArmFormat("xacro", "xacro: the same as a macro with a prefix", whole=True, text=_xacro),
)
