"""Documents against the code: tables, snippets, quoted code and paths."""

import inspect
import re
import runpy
from pathlib import Path

import gymnasium
import pytest

from relpos_env import formation_v0
from relpos_env.api.gym_env import FormationGymEnv
from relpos_env.api.parallel_env import FormationEnv
from relpos_env.api.vector_env import FormationVectorEnv
from relpos_env.config import FormationConfig
from relpos_env.interface.observations import OBSERVATIONS
from relpos_env.tasks import TASKS

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
with pytest.MonkeyPatch.context() as patch:
    patch.syspath_prepend(str(ROOT / "benchmarks"))
    MAKE = runpy.run_path(str(ROOT / "benchmarks" / "make_tables.py"))
CODE = re.compile(r"^```(?:python|toml)\n(.*?)^```", re.DOTALL | re.MULTILINE)
TOP = (
    "tracking/",
    "relpos_env/",
    "agents/",
    "hardware_bridge/",
    "tests/",
    "docs/",
    "examples/",
    "benchmarks/",
)


def snippets(page):
    return CODE.findall((DOCS / page).read_text())


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda p: p.name)
def test_tables_are_those_of_the_code(page):
    text = page.read_text()
    assert MAKE["rewrite"](text) == text, "run python benchmarks/make_tables.py"


def test_every_table_is_somewhere():
    pages = "".join(page.read_text() for page in DOCS.rglob("*.md"))
    assert all(f"<!-- table: {name} -->" in pages for name in MAKE["TABLES"])


def test_tables_are_complete():
    tables = MAKE["TABLES"]
    assert {f"observation-{mode}" for mode in OBSERVATIONS} <= set(tables)
    for field in FormationConfig.__dataclass_fields__:
        assert f"| `{field}` |" in tables["arguments"]()
    for task in TASKS:
        assert f"| `{task}` |" in tables["weights"]()


@pytest.mark.parametrize(("at_two", "at_three", "size"), [
    (2, 2, "2"), (1, 2, "n - 1"), (2, 4, "2 (n - 1)"), (14, 22, "8 (n - 1) + 6"),
])  # fmt: skip
def test_sizes_in_cars(at_two, at_three, size):
    assert MAKE["environment"].in_others(at_two, at_three) == size
    for n, value in ((2, at_two), (3, at_three)):
        assert eval(size.replace(" (", " * ("), {"n": n}) == value


def test_infos_are_told():
    text = (DOCS / "reference" / "environment.md").read_text()
    infos = text[text.index("## Infos") : text.index("## Options of a reset")]
    told = set(re.findall(r"^\| `(\w+)`", infos, re.MULTILINE)) | {"active"}
    options = {"observation": "truth", "max_cycles": 4}
    cars = formation_v0.parallel_env(**options)
    one = gymnasium.make("relpos_env/Formation-v0", **options)
    batch = gymnasium.make_vec("relpos_env/Formation-v0", num_envs=2, **options)
    infos = [cars.reset(seed=0)[1]["car_0"], one.reset(seed=0)[1], batch.reset(seed=0)[1]]
    keys = {re.sub("reward_.*", "reward_", key) for info in infos for key in info}
    assert {key for key in keys if not key.startswith("_")} == told


@pytest.mark.parametrize("form", [FormationEnv, FormationGymEnv, FormationVectorEnv])
def test_arguments_of_the_forms_are_told(form):
    text = (DOCS / "reference" / "environment.md").read_text()
    for name in list(inspect.signature(form).parameters)[:-1]:
        assert f"| `{name}` |" in text


@pytest.mark.parametrize(
    "code", snippets("reference/environment.md"), ids=lambda c: c.splitlines()[0]
)
@pytest.mark.filterwarnings("ignore:Creating .*WeightUpdater:DeprecationWarning")
def test_snippets_run(code, tmp_path, monkeypatch):
    if "sb3" in code:
        pytest.importorskip("stable_baselines3")
    if "torchrl" in code:
        pytest.importorskip("torchrl")
    monkeypatch.chdir(tmp_path)
    exec(compile(code.replace("96_000", "1600"), "environment.md", "exec"), {})


QUOTED = [code for code in snippets("how-to/adding.md") if code.startswith("# ")]


@pytest.mark.parametrize("code", QUOTED, ids=lambda c: c.splitlines()[0])
def test_quoted_code_is_that_of_the_file(code):
    """The first line names the file; a line of three dots marks an omission."""
    name, _, quoted = code.partition("\n")
    text = (ROOT / name.removeprefix("# ")).read_text()
    for part in re.split(r"^\s*\.\.\.$\n", quoted, flags=re.MULTILINE):
        assert part.strip("\n") in text, part


@pytest.mark.parametrize("page", [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))],
                         ids=lambda p: p.name)  # fmt: skip
def test_named_paths_exist(page):
    for name in re.findall(r"`([\w./*-]+/[\w./*-]*)`", page.read_text()):
        if name.startswith(TOP) and (name.endswith("/") or "." in name):
            assert list(ROOT.glob(name.rstrip("/"))), name
