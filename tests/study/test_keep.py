"""A row's log is a file that a sweep wrote below the folder of the results, and nothing else."""

import pytest

from mjnav.study.keep import NAME, kept_log, log_name

ID = "0123456789abcdef0123456789abcdef"


@pytest.mark.parametrize("label", ["hall", "../../etc", "a b/c\n", "ü" * 300, "./policy.py:Policy weight=3.0", ""])
def test_any_labels_give_a_name_within_the_folder(label):
    name = log_name((label, "default", "rkhs"), 2**63 - 1, ID)
    assert NAME.fullmatch(name)
    assert len(name) < 255


def test_only_a_regular_file_of_such_a_name_below_the_folder_is_a_log(tmp_path):
    folder = tmp_path / "results"
    name = log_name(("hall", "default", "rkhs"), 3, ID)
    assert kept_log(folder, name) is None
    (folder / "logs").mkdir(parents=True)
    (folder / name).write_bytes(b"")
    assert kept_log(folder, name) == folder / name
    outside = tmp_path / "outside-0123456789abcdef.mcap"
    outside.write_bytes(b"")
    link = log_name(("link", "default", "rkhs"), 3, ID)
    (folder / link).symlink_to(outside)
    for other in (None, "", link, f"logs/../../{outside.name}", str(outside), "part.parquet", f"{name}\n"):
        assert kept_log(folder, other) is None
    elsewhere = tmp_path / "linked"
    elsewhere.mkdir()
    (elsewhere / "logs").symlink_to(folder / "logs")
    assert kept_log(elsewhere, name) is None
