"""Loops of a package that does not ask for it are kept on disk, and are not compiled again in another Python."""

import os
import subprocess
import sys

SOURCE = "from numba import njit\n\n@njit\ndef twice(x):\n    return 2 * x\n"
RUN = """
import sys
sys.path.insert(0, sys.argv[1])
from vibrissa.neural.sorting.compiled import keep_compiled
assert keep_compiled("looped", ("loops", "absent")) == ["looped.loops.twice"]
from looped.loops import twice
assert twice(21) == 42
print(sum(twice.stats.cache_hits.values()), sum(twice.stats.cache_misses.values()))
"""


def test_what_one_python_compiled_the_next_one_loads(tmp_path):
    (tmp_path / "looped").mkdir()
    (tmp_path / "looped" / "__init__.py").touch()
    (tmp_path / "looped" / "loops.py").write_text(SOURCE)
    there = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    said = [
        subprocess.run(
            [sys.executable, "-c", RUN, str(tmp_path)], env=there, capture_output=True, text=True, check=True
        )
        for _ in range(2)
    ]
    assert [one.stdout.split() for one in said] == [["0", "1"], ["1", "0"]]
