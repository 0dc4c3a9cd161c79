import pytest

from twolink.files import written_whole


def test_a_file_is_replaced_when_all_is_written(tmp_path):
    file = tmp_path / "a.txt"
    file.write_text("old")
    with written_whole(file) as temporary:
        temporary.write_text("new")
        assert file.read_text() == "old"
    assert file.read_text() == "new"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("fault", [RuntimeError, KeyboardInterrupt])
def test_what_goes_wrong_leaves_the_old_file(tmp_path, fault):
    file = tmp_path / "a.txt"
    file.write_text("old")

    def interrupted():
        with written_whole(file) as temporary:
            temporary.write_text("half")
            raise fault

    with pytest.raises(fault):
        interrupted()
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]
