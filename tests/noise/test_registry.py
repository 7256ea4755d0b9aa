import subprocess
import sys

import pytest

from mjnav.errors import InvalidValue
from mjnav.noise import make_distribution

EXAMPLES = {
    "pearson": {"std": 0.1, "skew": 1.2, "kurtosis": 5.2},
    "mixture": {"weights": [0.4, 0.6], "means": [-1, 1], "stds": [0.1, 0.6]},
    "gaussian": {"std": 1},
    "uniform": {"half_width": 0.5},
    "student_t": {"std": 1.0, "df": 5},
    "empirical": {"samples": [0.0, 0.1, 0.5]},
    "zero": {},
}


@pytest.mark.parametrize(
    ("name", "arguments", "key", "message"),
    [
        ("pearsn", {}, "distribution", "found 'pearsn'; allowed: .*did you mean 'pearson'"),
        ("pearson", {"std": 1, "skew": 1, "kurtosi": 5}, "kurtosi", "allowed: .*did you mean 'kurtosis'"),
        ("gaussian", {}, "std", "a number > 0 and <= 10000; this key is required$"),
        ("gaussian", {"std": float("nan")}, "std", "found nan"),
        ("gaussian", {"std": 10**400}, "std", "a number > 0"),
        ("gaussian", {"std": 1.0, "mean": float("inf")}, "mean", "found inf; allowed: a number from -10000 to 10000$"),
        ("mixture", {"weights": [0.4, 0.4], "means": [0, 1], "stds": [1, 1]}, "weights", r"sum is 1, not 0\.8"),
        ("mixture", {"weights": [1.4, -0.4], "means": [0, 1], "stds": [1, 1]}, "weights.0", r"found 1\.4; allowed: "),
        ("mixture", {"weights": [0.4, 0.6], "means": [0], "stds": [1, 1]}, "means", "as many numbers as weights: 2"),
        ("empirical", {"samples": [1.0]}, "samples", "from 2 to 10000 of them"),
        ("empirical", {"samples": [1.0, 1.0]}, "samples", "two different numbers"),
        ("zero", {"std": 1}, "std", "allowed: distribution$"),
    ],
)
def test_a_wrong_argument_is_named_with_what_is_allowed(name, arguments, key, message):
    with pytest.raises(InvalidValue, match=message) as error:
        make_distribution(name, **arguments)
    assert error.value.key == key


def test_import_brings_neither_scipy_nor_numba():
    code = "import sys, mjnav.noise; print({'scipy', 'numba'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
