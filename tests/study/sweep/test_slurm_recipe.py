"""The README's recipe for SLURM makes the jobs that it says it makes."""

import re
import subprocess
from pathlib import Path

import dask
import distributed  # noqa: F401 - its settings, which what is set here would else stand alone
import pytest

README = Path(__file__).parents[3] / "README.md"
HEADING = "## On a SLURM cluster"


@pytest.fixture(scope="module")
def recipe(tmp_path_factory) -> tuple[str, int]:
    """Its job script, and how many workers an episode may lose."""
    found = re.search(rf"^#*{HEADING}\n.*?^```python\n(.*?)^```$", README.read_text(), re.MULTILINE | re.DOTALL)
    assert found is not None, f"README.md has no recipe under {HEADING!r}"
    code = found[1].partition("cluster.scale(")[0]  # no jobs are submitted
    assert 'interface="ib0"' in code
    code = code.replace('interface="ib0"', 'interface="lo"')
    names = {}
    with dask.config.set({"distributed.scheduler.allowed-failures": 3}), pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("shared"))
        command = next(line for line in code.splitlines() if line.startswith("openssl "))
        subprocess.run(command.split(), capture_output=True, check=True)
        exec(code, names)
        try:
            return names["cluster"].job_script(), dask.config.get("distributed.scheduler.allowed-failures")
        finally:
            names["cluster"].close()


def test_a_job_asks_for_what_its_workers_use(recipe):
    for line in ("-p cpu", "-n 1", "--cpus-per-task=16", "--mem=15G", "-t 04:00:00"):
        assert f"#SBATCH {line}\n" in recipe[0]


def test_a_worker_has_one_thread_and_ends_before_its_job(recipe):
    command = next(line for line in recipe[0].splitlines() if "distributed.cli.dask_worker" in line)
    assert " tls://127.0.0.1:" in command
    for option in ("ca-file", "cert", "key"):
        assert f" --tls-{option} /" in command
    for option in ("--nworkers 16", "--nthreads 1", "--nanny", "--lifetime 225m", "--lifetime-stagger 10m"):
        assert f" {option}" in command


def test_an_episode_outlives_more_workers_than_by_default(recipe):
    assert recipe[1] == 10
