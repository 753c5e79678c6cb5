import json
import subprocess
import sys

import pytest

OPTIONAL = (
    "dask",
    "distributed",
    "numbagg",
    "bottleneck",
)  # of other packages that may be there; xarray may import them
HEAVY = {"scipy", "matplotlib", "xarray", "pandas", "numba", "dask", "av", "tifffile", "pydantic", "h5py", "sklearn"}
START = "import json, sys\n"
ALONE = START + f"sys.modules.update(dict.fromkeys({OPTIONAL!r}))\n"
END = """
print(json.dumps(sorted(name for name, module in sys.modules.items() if module)), file=sys.stderr)
"""
MODES = "modes --contact 0.29"
SCAN = "scan {texture} --contact 0.29 --base-angle 1.2 --speed 0.1 --atlas C2 --out {out}"
MAP = "map --texture {texture} --contact 0.2:0.4:2 --base-angle 0.8:1.4:2 --speed 0.1 --atlas C2 --out {out}"


def loaded(code, start=ALONE):
    """Give what code prints, and the modules that are loaded after it."""
    done = subprocess.run([sys.executable, "-c", start + code + END], capture_output=True, text=True, check=True)
    return done.stdout, set(json.loads(done.stderr.splitlines()[-1]))


def command(words, code=0):
    """Code that runs a command, which ends with an exit code."""
    run = f"sys.argv = ['vibrissa', *{words.split()!r}]\ntry: main()\nexcept SystemExit as end: "
    return f"from vibrissa.cli import main\n{run}assert (end.code or 0) == {code}\n"


@pytest.fixture
def files(tmp_path):
    """Texture of three gaps, and where results go."""
    (tmp_path / "texture.csv").write_text("position,width\n0.001,2e-4\n0.003,3e-4\n0.006,1e-4\n")
    return {"texture": tmp_path / "texture.csv", "out": tmp_path / "out.nc"}


@pytest.mark.parametrize("code", ["import vibrissa", command("--help")], ids=["import", "help"])
def test_nothing_heavy_is_imported_before_a_command_needs_it(code):
    said, modules = loaded(code)
    assert not HEAVY & {name.partition(".")[0] for name in modules}
    assert "modes" in said or code == "import vibrissa"


def test_modes_compile_nothing():
    said, modules = loaded(command(MODES), START)
    assert "128.657" in said
    assert not {"numba", "dask.array", "matplotlib", "scipy.stats", "scipy.signal"} & modules


def test_a_scan_imports_neither_statistics_nor_filters(files):
    _, modules = loaded(command(SCAN.format(**files)))
    assert "numba" in modules
    assert not {"scipy.stats", "scipy.signal", "matplotlib", "sklearn", "statsmodels", "pydantic"} & modules
    assert files["out"].is_file()


def test_the_page_imports_neither_statistics_nor_filters():
    pytest.importorskip("starlette", reason="the extra page is not installed")
    page, preset = "from vibrissa.page.application import Page", "from vibrissa.page.panel.presets import CLEAN"
    start = f"{page}\n{preset}\nPage(1).warm_up(CLEAN)\n"
    _, modules = loaded(start)
    assert "numba" in modules
    assert not {"scipy.stats", "scipy.signal", "matplotlib", "pydantic"} & modules


def test_a_map_needs_no_dask(files):
    _, modules = loaded(command(MAP.format(**files)))
    assert not {"dask", "distributed"} & modules
    assert files["out"].is_file()


def test_a_cluster_without_its_extra_is_refused_in_one_line(files):
    words = f"{MAP.format(**files)} --scheduler tcp://127.0.0.1:1"
    done = subprocess.run([sys.executable, "-c", ALONE + command(words, 2)], capture_output=True, text=True, check=True)
    assert "needs distributed" in done.stderr.splitlines()[-1]
    assert "vibrissa[cluster]" in done.stderr
