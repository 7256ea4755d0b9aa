"""`mjnav show`."""

from mjnav.scene import data_folder, load


def test_a_shipped_file_is_printed_as_it_is(mjnav, tmp_path):
    text = (data_folder("runs") / "hall.toml").read_text(encoding="utf-8")
    said = mjnav("show", "hall")
    assert (said.code, said.out, said.err) == (0, text, "")
    assert mjnav("show", "hall", "-o", "mine.toml").out == ""
    assert load("./mine.toml") == load("hall")
    assert 'controller = "' in mjnav("show", "methods").out


def test_with_a_seed_a_scene_is_printed_as_that_run_has_it(mjnav, tmp_path):
    (tmp_path / "drawn.toml").write_text(mjnav("show", "rooms", "--seed", "5").out)
    assert load("./drawn.toml") == load("rooms", seed=5)


def test_values_that_replace_the_files_show_the_layout_that_they_draw(mjnav, tmp_path):
    (tmp_path / "held.toml").write_text(mjnav("show", "rooms", "--set", "layout.purpose=training").out)
    held, drawn = load("./held.toml"), load("rooms", ["layout.purpose=training"])
    assert held == drawn
    assert held.people != load("rooms").people
    assert "did you mean 'layout'?" in mjnav("show", "rooms", "--set", "layuot.seed=7").err
