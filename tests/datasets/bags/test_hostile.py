"""Bags that someone has made to hurt, or that were cut off: bounded, and in words."""

import bz2
import sqlite3
import struct
from pathlib import Path

import pytest

from datasets.test_images import claimed_png
from handeye.datasets.bags import grey_of, is_bag, read_contents
from handeye.datasets.bags.mcap import MAGIC as MCAP
from handeye.datasets.bags.messages import READERS, Compressed, Raw
from handeye.datasets.bags.rosbag1 import MAGIC as ROSBAG1
from handeye.datasets.bags.unpacking import unpacked
from handeye.datasets.bags.wire import Wire
from handeye.errors import InputError


def fields(**values: bytes) -> bytes:
    parts = [name.encode() + b"=" + value for name, value in values.items()]
    return b"".join(struct.pack("<I", len(part)) + part for part in parts)


def record(header: bytes, data: bytes) -> bytes:
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def mcap_record(opcode: int, content: bytes, size: int | None = None) -> bytes:
    return struct.pack("<BQ", opcode, len(content) if size is None else size) + content


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def refused(path: Path, content: bytes, match: str) -> None:
    path.write_bytes(content)
    assert is_bag(path)
    with pytest.raises(InputError, match=match) as caught:
        read_contents(path)
    assert str(path) in caught.value.message


def test_a_chunk_that_unpacks_to_more_than_it_says(tmp_path: Path) -> None:
    bomb = bz2.compress(bytes(1 << 25))
    header = fields(op=b"\x05", compression=b"bz2", size=struct.pack("<I", 1000))
    refused(tmp_path / "a.bag", ROSBAG1 + record(header, bomb), "unpack to more than 1000")
    claims = fields(op=b"\x05", compression=b"bz2", size=struct.pack("<I", 1 << 28))
    refused(tmp_path / "b.bag", ROSBAG1 + record(claims, bomb), "unpack to more than 16777216")
    zstd = pytest.importorskip(
        "backports.zstd", reason="backports.zstd is not installed (extra bags)"
    ).compress(bytes(1 << 25))
    chunk = struct.pack("<QQQI", 0, 0, 1 << 28, 0) + text("zstd") + struct.pack("<Q", len(zstd)) + zstd
    refused(tmp_path / "c.mcap", MCAP + mcap_record(0x06, chunk), "unpack to more than")
    lz4 = pytest.importorskip("lz4.frame", reason="lz4 is not installed (extra bags)").compress(
        bytes(1 << 26)
    )
    with pytest.raises(InputError, match="unpack to more than"):
        unpacked(lz4, "lz4", 1 << 20, "x")


@pytest.mark.parametrize("method", ["bz2", "lz4", "zstd", "rot13"])
def test_bytes_that_are_not_compressed(method: str) -> None:
    with pytest.raises(InputError, match=r"damaged|expected bz2"):
        unpacked(b"no such thing" * 100, method, 1 << 20, "x")


def test_lengths_that_no_record_has(tmp_path: Path) -> None:
    refused(tmp_path / "a.bag", ROSBAG1 + struct.pack("<I", 0xFFFFFFFF), "a header of 4294967295 bytes")
    huge = struct.pack("<I", 4) + b"\0\0\0\0" + struct.pack("<I", 0xFFFFFFF0)
    refused(tmp_path / "b.bag", ROSBAG1 + huge, "a record of 4294967280 bytes")
    refused(tmp_path / "c.bag", ROSBAG1 + record(b"\xff\xff\xff\x7fabc", b""), "no list of fields")
    refused(tmp_path / "d.bag", ROSBAG1 + record(fields(op=b"\x07"), b""), "without its field conn")
    refused(tmp_path / "e.bag", ROSBAG1 + record(fields(op=b"\x03", encryptor=b"gpg"), b""), "encrypted")
    refused(tmp_path / "f.mcap", MCAP + mcap_record(0x05, b"", size=1 << 62), "a record of")
    refused(
        tmp_path / "g.mcap", MCAP + mcap_record(0x04, b"\0\0\0\0" + struct.pack("<I", 1 << 31)), "cut off"
    )
    refused(tmp_path / "h.mcap", MCAP + mcap_record(0x03, b"\1\0" + text("\n" * 5000)), "cut off")


def test_what_breaks_off_is_read_up_to_there(tmp_path: Path) -> None:
    for name, content in (("a.bag", ROSBAG1 + b"\x10\0\0\0abc"), ("b.mcap", MCAP + b"\x05\x10")):
        (tmp_path / name).write_bytes(content)
        found = read_contents(tmp_path / name)
        assert found.is_cut
        assert not found.topics
    # A length far beyond the end of what is of no use is passed over.
    (tmp_path / "c.mcap").write_bytes(MCAP + mcap_record(0x09, b"", size=1 << 63))
    assert read_contents(tmp_path / "c.mcap").is_cut


def test_a_database_that_is_no_bag_or_runs_something(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE topics (id, name, type, serialization_format)")
        database.execute(
            "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
            "SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n"
        )
    with pytest.raises(InputError, match="no tables topics and messages"):
        read_contents(path)
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(InputError):
        read_contents(path)
    (tmp_path / "b.db3").write_bytes(b"SQLite format 3\0" + bytes(200))
    with pytest.raises(InputError, match="no database"):
        read_contents(tmp_path / "b.db3")


def test_a_database_with_values_of_other_kinds(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE topics (id, name, type, serialization_format)")
        database.execute("CREATE TABLE messages (id, topic_id, timestamp, data)")
        database.execute("INSERT INTO topics VALUES (1, '/tf', 'tf2_msgs/msg/TFMessage', 'cdr')")
        database.execute("INSERT INTO messages VALUES (1, 1, 'soon', 'now')")
    with pytest.raises(InputError, match="a message that is none"):
        read_contents(path)


@pytest.mark.parametrize("kind", sorted(READERS))
@pytest.mark.parametrize("is_cdr", [True, False])
def test_messages_that_claim_more_than_they_are(kind: str, is_cdr: bool) -> None:
    for filling in (b"\xff", b"\x7f", b"\0", b"\1"):
        for length in (0, 3, 4, 5, 40, 300):
            data = (b"\0\1\0\0" if is_cdr else b"") + filling * length
            try:
                READERS[kind](Wire(data, is_cdr=is_cdr, where="x"))
            except InputError as error:
                assert error.code == "damaged_bag"


def test_metadata_that_leads_out_of_its_folder(tmp_path: Path) -> None:
    (tmp_path / "other.mcap").write_bytes(MCAP)
    bag = tmp_path / "bag"
    bag.mkdir()
    metadata = "rosbag2_bagfile_information:\n  relative_file_paths: [../other.mcap]\n"
    (bag / "metadata.yaml").write_text(metadata)
    with pytest.raises(InputError, match="missing"):
        read_contents(bag)
    (bag / "other.mcap").symlink_to(tmp_path / "other.mcap")
    with pytest.raises(InputError, match="link out of"):
        read_contents(bag)
    (bag / "metadata.yaml").write_text(metadata + "  compression_mode: FILE\n")
    with pytest.raises(InputError, match="file by file"):
        read_contents(bag)


def test_pictures_in_messages_that_claim_more_than_they_hold(tmp_path: Path) -> None:
    png = claimed_png(tmp_path / "a.png", 16000, 16000).read_bytes()
    bmp = struct.pack("<2sIHHIIiiHHIIiiII", b"BM", 60, 0, 0, 54, 40, 16000, 16000, 1, 24, 0, 0, 0, 0, 0, 0)
    jpeg = b"\xff\xd8\xff\xc0\x00\x0b\x08" + struct.pack(">HH", 65000, 65000) + b"\x01\x01\x11\x00\xff\xd9"
    for content in (png, bmp + bytes(6), jpeg):
        with pytest.raises(InputError, match=r"which no camera's picture has|expected at most") as caught:
            grey_of(Compressed(0, "png", memoryview(content)), "x")
        assert caught.value.code == "too_large"
    for height, width, step in ((1 << 31, 1 << 31, 1 << 31), (1 << 14, 1 << 14, 1 << 14), (1, 1 << 28, 1)):
        for encoding in ("mono8", "mono16", "rgb8"):
            with pytest.raises(InputError, match="in 9 bytes"):
                grey_of(Raw(0, height, width, encoding, False, step, memoryview(bytes(9))), "x")
