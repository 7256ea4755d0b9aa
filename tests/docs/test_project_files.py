"""CITATION.cff and the workflow agree with pyproject.toml."""

import tomllib

import yaml

from tests.docs.test_pages import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert (citation["title"], citation["license"]) == (PROJECT["name"], PROJECT["license"])
    assert citation["version"] == PROJECT["version"]
    assert all(author["family-names"] for author in citation["references"][0]["authors"])


def test_the_workflow_runs_every_supported_python():
    job = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]["everything"]
    prefix = "Programming Language :: Python :: "
    supported = [name.removeprefix(prefix) for name in PROJECT["classifiers"] if name.startswith(prefix)]
    assert job["strategy"]["matrix"]["python"] == supported
    assert {"run": ".ci/run"} in job["steps"]
