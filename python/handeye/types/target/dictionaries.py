"""The predefined dictionaries of OpenCV's ArUco module.

In the order of OpenCV's numbers (`cv2.aruco.DICT_4X4_50` is 0), each with the number of its markers.
"""

from handeye.codes import Code
from handeye.errors import InputError

DICTIONARIES: dict[str, int] = {
    "DICT_4X4_50": 50,
    "DICT_4X4_100": 100,
    "DICT_4X4_250": 250,
    "DICT_4X4_1000": 1000,
    "DICT_5X5_50": 50,
    "DICT_5X5_100": 100,
    "DICT_5X5_250": 250,
    "DICT_5X5_1000": 1000,
    "DICT_6X6_50": 50,
    "DICT_6X6_100": 100,
    "DICT_6X6_250": 250,
    "DICT_6X6_1000": 1000,
    "DICT_7X7_50": 50,
    "DICT_7X7_100": 100,
    "DICT_7X7_250": 250,
    "DICT_7X7_1000": 1000,
    "DICT_ARUCO_ORIGINAL": 1024,
    "DICT_APRILTAG_16h5": 30,
    "DICT_APRILTAG_25h9": 35,
    "DICT_APRILTAG_36h10": 2320,
    "DICT_APRILTAG_36h11": 587,
    "DICT_ARUCO_MIP_36h12": 250,
}


# Bits along a side, where the name does not begin with them.
_OTHER_BITS = {"ORIGINAL": 5, "16h5": 4, "25h9": 5, "36h10": 6, "36h11": 6, "36h12": 6}


def marker_count(name: str) -> int:
    """Return the number of markers of a dictionary."""
    return DICTIONARIES[name]


def marker_bits(name: str) -> int:
    """Return the number of bits along a side of the markers of a dictionary, its border apart."""
    kind, last = name.split("_")[1], name.rsplit("_", 1)[-1]
    return int(kind[0]) if "X" in kind else _OTHER_BITS[last]


def check_dictionary(name: str, markers: int, what: str) -> None:
    """Check that a dictionary is one of OpenCV's and has enough markers.

    Raises
    ------
    InputError
        An unknown name, or fewer markers than the board needs.
    """
    if name not in DICTIONARIES:
        raise InputError(
            f"{what}: dictionary {name!r}, expected one of {', '.join(DICTIONARIES)}",
            code=Code.UNKNOWN_DICTIONARY,
        )
    if markers > DICTIONARIES[name]:
        raise InputError(
            f"{what}: {markers} markers, but {name} has {DICTIONARIES[name]}",
            code=Code.OUT_OF_RANGE,
            hint="name the dictionary that the board was printed with",
        )


def dictionary_of_number(number: int, what: str) -> str:
    """Return the name of OpenCV's dictionary of this number, as other tools' files give it.

    Raises
    ------
    InputError
        No such number.
    """
    names = list(DICTIONARIES)
    if not 0 <= number < len(names):
        raise InputError(
            f"{what}: dictionary {number}, expected 0 to {len(names) - 1}", code=Code.UNKNOWN_DICTIONARY
        )
    return names[number]
