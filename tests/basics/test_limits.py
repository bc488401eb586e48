import struct
import zipfile

import pytest
from golden import refused

from historysim.basics.limits import LIMITS, at_most, check_archive, most


def test_the_environment_raises_a_limit(monkeypatch):
    assert most("STEPS") == LIMITS["STEPS"]
    for given, taken in (
        ("1e9", 10**9),
        ("12", 12),
        ("many", LIMITS["STEPS"]),
        ("inf", LIMITS["STEPS"]),
    ):
        monkeypatch.setenv("HISTORYSIM_MOST_STEPS", given)
        assert most("STEPS") == taken
    monkeypatch.setenv("HISTORYSIM_MOST_STEPS", "12")
    assert (
        at_most("STEPS")
        == "expected 12 at most (the environment variable HISTORYSIM_MOST_STEPS raises it)"
    )


def packed(path, size):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("zeros", bytes(size))
    return path


@pytest.mark.parametrize("trusted", [True, False])
def test_what_unpacks_to_too_much_is_refused(tmp_path, monkeypatch, trusted):
    path = packed(tmp_path / "a.zip", 1_000_000)
    check_archive(path, trusted=trusted)
    monkeypatch.setenv("HISTORYSIM_MOST_UNPACKED_BYTES", "1e5")
    with refused(r"unpack to 1,000,000 .*UNPACKED_BYTES"):
        check_archive(path, trusted=trusted)
    with path.open("rb") as stream, refused(r"unpack to 1,000,000"):
        check_archive(stream, trusted=trusted)


def test_what_an_archive_says_of_itself_is_not_believed(tmp_path, monkeypatch):
    path = packed(tmp_path / "a.zip", 1_000_000)
    content = path.read_bytes()
    path.write_bytes(content.replace(struct.pack("<I", 1_000_000), struct.pack("<I", 10)))
    monkeypatch.setenv("HISTORYSIM_MOST_UNPACKED_BYTES", "1e5")
    check_archive(path)
    with refused(r"unpack to 1,000,000"):
        check_archive(path, trusted=False)


def test_anything_else_is_left_to_its_reader(tmp_path):
    (tmp_path / "text").write_text("no archive", encoding="utf-8")
    check_archive(tmp_path / "text", trusted=False)
