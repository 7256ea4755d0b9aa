"""`mjnav calibrate`: what it prints, what it draws and what it refuses."""

from mjnav.study.calibration import SETTINGS

SHORT = ("--set", "time_limit=1.0", "--set", "physics.engine=kinematic", "--draws", "100", "--seeds", "2")


def test_every_method_and_setting_has_a_row_and_a_curve_and_the_picture_is_drawn(mjnav, tmp_path):
    said = mjnav("calibrate", "crossing1", "--controller", "rkhs", "mean", *SHORT, "-o", "curve.png")
    assert said.code == 0
    lines = said.out.splitlines()
    assert lines[-1] == "curve.png"
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
    assert lines[0] == "crossing1, seeds 0 to 1, every 5 ticks, 100 draws"
    assert [tuple(line.split()[:3]) for line in lines[4:10]] == [
        (setting, method, "4") for setting in SETTINGS for method in ("rkhs", "mean")
    ]
    curves = [line.split() for line in lines[12:-2]]
    for method in ("rkhs", "mean"):
        for setting in SETTINGS:
            assert sum(int(row[2]) for row in curves if row[:2] == [setting, method]) == 4
