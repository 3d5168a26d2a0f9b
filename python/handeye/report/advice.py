"""What to do about a finding."""

_ADVICE = {
    "blame_nothing": (
        "The images are the limit: a larger or closer board, more pixels, a sharper lens or more views help."
    ),
    "blame_robot_flange": (
        "The arm is the limit. Its error averages out over views that differ; more points or a closer board "
        "do not help. If it is larger than the maker states, look for a loose camera or board, or for poses "
        "taken while the arm still moved."
    ),
    "blame_robot_base": (
        "The arm is the limit, as if its base moved: a base that gives way, or errors of the first joints. "
        "Views close to where the work is matter most then."
    ),
    "blame_robot_links": (
        "The arm is not built quite as described. The answer is that of the arm as it is, and poses are put "
        "right by what was found of its links (link_errors in the result). Where the controller's poses are "
        "used as they are, solve without the arm: that answer fits them better."
    ),
    "blame_camera": (
        "Calibrate the camera again, with the focus and the size of image that are used here, and the board "
        "near all edges of the image."
    ),
    "blame_board_scale": (
        "Measure the board over its whole width and correct the target file; the error goes straight into "
        "the position of the camera."
    ),
}


def advice(code: str) -> str:
    """Return what to do about a finding, nothing if there is nothing to say."""
    return _ADVICE.get(code, "")
