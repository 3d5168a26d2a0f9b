"""The recording that comes with the package, for demonstrations and first steps."""

from pathlib import Path

SHIPPED = "CS_synthetic_3"


def shipped_recording() -> Path:
    """Return the folder of the shipped recording.

    Corners and robot poses of the set CS_synthetic_3 of Ali, Suominen, Gotchev and Ruiz Morales (Sensors
    19(12), 2837, 2019): 30 rendered views of a chessboard, found by our own detection, with the true pose of
    the camera.
    """
    return Path(__file__).resolve().parents[1] / "data" / SHIPPED
