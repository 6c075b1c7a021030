"""Files written whole: no link is followed, and permissions are those of any other file."""

import os
import secrets

import pytest

from pymoo_hdte._io.whole_file import write_new, write_whole


def test_a_link_in_the_place_of_the_temporary_file_is_not_followed(tmp_path, monkeypatch):
    """Even where somebody guesses the name."""
    monkeypatch.setattr(secrets, "token_hex", lambda size: "guessed")
    target = tmp_path / "thesis.txt"
    target.write_text("years of work")
    for link in (target, tmp_path / "nowhere"):
        (tmp_path / ".a.csv.guessed.tmp").symlink_to(link)
        with pytest.raises(FileExistsError):
            write_whole(tmp_path / "a.csv", b"1\n")
        (tmp_path / ".a.csv.guessed.tmp").unlink()
    assert target.read_text() == "years of work"
    assert [one.name for one in tmp_path.iterdir()] == ["thesis.txt"]


def test_temporary_names_cannot_be_foreseen(tmp_path, monkeypatch):
    names, replace = [], os.replace
    monkeypatch.setattr(os, "replace", lambda a, b: (names.append(str(a)), replace(a, b)))
    for _ in range(2):
        write_whole(tmp_path / "a.csv", b"1\n")
    assert len(set(names)) == 2
    assert (tmp_path / "a.csv").read_bytes() == b"1\n"
    assert [one.name for one in tmp_path.iterdir()] == ["a.csv"]


def test_a_file_is_as_readable_as_any_other(tmp_path):
    (tmp_path / "other").write_bytes(b"")
    write_whole(tmp_path / "a.csv", b"1\n")
    assert (tmp_path / "a.csv").stat().st_mode == (tmp_path / "other").stat().st_mode


def test_a_link_in_the_place_of_the_file_itself_is_replaced(tmp_path):
    target = tmp_path / "thesis.txt"
    target.write_text("years of work")
    (tmp_path / "a.csv").symlink_to(target)
    write_whole(tmp_path / "a.csv", b"1\n")
    assert target.read_text() == "years of work"
    assert not (tmp_path / "a.csv").is_symlink()


@pytest.mark.parametrize("links", [True, False])
def test_a_new_file_replaces_nothing(links, tmp_path, monkeypatch):
    if not links:

        def refused(*paths):
            raise PermissionError

        monkeypatch.setattr(os, "link", refused)
    path = tmp_path / "file"
    write_new(path, b"first")
    with pytest.raises(FileExistsError):
        write_new(path, b"second")
    assert path.read_bytes() == b"first"
    assert list(tmp_path.iterdir()) == [path]
