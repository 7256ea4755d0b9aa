"""The studies that the items share, and the order of their episodes."""

from mjnav.paper.episodes import TUNED, studies, trials
from mjnav.paper.items import ITEMS
from mjnav.paper.pareto import CURVES
from mjnav.study.cells import variants
from mjnav.study.study_file import load_study


def test_the_episodes_of_all_items_take_turns_seed_by_seed():
    wanted = studies([ITEMS["lane"], ITEMS["table"]], 3)
    every = trials(wanted)
    assert len({trial.id for trial in every}) == len(every) == 3 * sum(len(study.cells) for study in wanted)
    assert [trial.seed for trial in every] == sorted(trial.seed for trial in every)


def test_a_study_that_two_items_share_is_run_once_and_its_text_says_what_it_varies():
    one, many = studies([ITEMS["one"], ITEMS["many"], ITEMS["kld"]])
    assert (one.file.name, many.file.name) == ("paper-one", "paper-many")
    assert one.text.startswith(
        "scenes: crossing1; seeds 0 to 199\nevery combination of: physics.engine = ['kinematic', "
    )
    assert "method rkhs d=1: rkhs, degree = 1, weight = 1.0" in one.text


def test_methods_are_tuned_on_other_seeds_among_the_values_of_the_pareto_study():
    tuning, (pareto,) = load_study("paper-tuning"), ITEMS["pareto"].studies
    assert min(tuning.all_seeds) > max(pareto.all_seeds)
    first, second = ({v.names: v.overrides for v in variants(study, ["crossing3"])} for study in (tuning, pareto))
    assert first == second
    swept = {method.identifier: method.grid for method in CURVES}
    for label, method in TUNED.items():
        ((key, values),) = swept[label].items()
        assert method.set[key] in list(values)
