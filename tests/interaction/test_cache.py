import numpy as np
from pytest import fixture, mark

from historysim.interaction import solutions as cache

ARGUMENTS = (np.arange(3.0),)


@fixture
def counted(monkeypatch, tmp_path):
    monkeypatch.setenv("HISTORYSIM_CACHE", str(tmp_path / "cache"))
    calls = []

    def compute():
        calls.append(1)
        return {"a": np.arange(5.0)}

    return calls, compute, tmp_path / "cache"


def test_what_was_computed_is_not_computed_again(counted):
    calls, compute, _ = counted
    for _ in range(2):
        assert cache.load_or_compute("x", ARGUMENTS, compute)["a"].tolist() == [0, 1, 2, 3, 4]
    assert len(calls) == 1
    cache.load_or_compute("x", (np.arange(3.0) + 1e-16, np.arange(2.0)), compute)
    assert len(calls) == 2


@mark.parametrize("damage", [b"", b"PK", None])
def test_a_damaged_file_is_computed_again(counted, damage):
    calls, compute, folder = counted
    cache.load_or_compute("x", ARGUMENTS, compute)
    (path,) = folder.iterdir()
    content = path.read_bytes()
    middle = len(content) // 2
    path.write_bytes(
        content[:middle] + b"?????" + content[middle + 5 :] if damage is None else damage
    )
    assert cache.load_or_compute("x", ARGUMENTS, compute)["a"].tolist() == [0, 1, 2, 3, 4]
    assert len(calls) == 2
    assert path.read_bytes() == content


def test_a_folder_that_cannot_be_written_only_costs_time(counted, monkeypatch, tmp_path):
    calls, compute, _ = counted
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("HISTORYSIM_CACHE", str(tmp_path / "file"))
    for _ in range(2):
        assert "a" in cache.load_or_compute("x", ARGUMENTS, compute)
    assert len(calls) == 2


def test_the_folder_agrees_with_the_system(monkeypatch, tmp_path):
    monkeypatch.delenv("HISTORYSIM_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    assert cache.cache_folder() == tmp_path / "historysim"
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert cache.cache_folder() == tmp_path / "local" / "historysim"


@mark.parametrize("platform", ["linux", "win32"])
def test_nothing_is_cached_without_a_home_folder(counted, monkeypatch, platform):
    def home():
        raise RuntimeError("Could not determine home directory.")

    calls, compute, _ = counted
    for name in ("HISTORYSIM_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pathlib.Path.home", home)
    monkeypatch.setattr("sys.platform", platform)
    for _ in range(2):
        assert "a" in cache.load_or_compute("x", ARGUMENTS, compute)
    assert len(calls) == 2
