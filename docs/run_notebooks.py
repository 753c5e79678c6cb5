"""Run the notebooks of docs/learn into the cache from which the pages take their outputs.

python docs/run_notebooks.py CACHE SECONDS

No cell may take longer. A notebook that the cache has is not run again. The build starts this beside the pages, on
another core.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from jupyter_cache import get_cache
from jupyter_cache.base import CacheBundleIn
from jupyter_cache.executors.utils import single_nb_execution
from myst_nb.core.read import read_myst_markdown_notebook


def run(path, cache, longest):
    """Run one notebook, if the cache has it not."""
    notebook = read_myst_markdown_notebook(path.read_text(encoding="utf-8"), path=path)
    try:
        cache.match_cache_notebook(notebook)
    except KeyError:
        with TemporaryDirectory() as folder:
            done = single_nb_execution(notebook, cwd=folder, allow_errors=False, timeout=longest, meta_override=True)
        if done.err is not None:
            sys.exit(f"{path}: {done.exc_string}")
        bundle = CacheBundleIn(notebook, str(path), data={"execution_seconds": done.time})
        cache.cache_notebook_bundle(bundle, check_validity=False, overwrite=True)


if __name__ == "__main__":
    for page in sorted((Path(__file__).parent / "learn").glob("*.md")):
        run(page, get_cache(sys.argv[1]), int(sys.argv[2]))
